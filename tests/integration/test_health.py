# SPDX-License-Identifier: GPL-3.0-or-later
"""brainshiftd health, as a container's health check runs it."""
from programs import LOCAL, brainshiftd, serve, write


def test_health_is_zero_while_the_daemon_answers_and_one_after_it_has_gone(folder):
    with serve(folder) as daemon:
        ask = ("health", "--config", folder / "daemon.yaml", "--endpoint", daemon.address)
        alive = brainshiftd(*ask)
        assert alive.returncode == 0, alive.stderr
        assert alive.stdout.startswith("ok version=")
        assert "case=none" in alive.stdout

        assert daemon.end() == 0
        gone = brainshiftd(*ask)
        assert gone.returncode == 1
        assert len(gone.stderr.splitlines()) == 1, gone.stderr
        assert gone.stdout == ""


def test_health_needs_a_port_that_is_known(folder):
    asked = brainshiftd("health", "--config", write(folder / "daemon.yaml", LOCAL))
    assert asked.returncode == 2
    assert len(asked.stderr.splitlines()) == 1, asked.stderr
