# SPDX-License-Identifier: GPL-3.0-or-later
"""Eight displays of a field (displays.py), and what must not look to them like a good one that is current.

With BRAINSHIFT_STUDY_DIR the counts are recorded for `make faults`.
"""
import re
import time

import pytest
from conftest import record
from displays import DISPLAYS, FOLLOWING, LOOK_S, NOT_TOLD, STATES, Displays, Script, waited_for
from fake_daemon import FakeDaemon


@pytest.fixture(scope="module")
def place():
    script = Script()
    with FakeDaemon(script) as daemon:
        script.daemon = daemon
        displays = Displays(daemon.endpoint)
        yield script, displays
        displays.end()


def test_no_display_takes_what_is_no_good_current_field_for_one(place):
    script, displays = place
    told, looked, green, untold = 0, 0, [], []
    for state, (_, _, says) in STATES.items():
        script.set("fresh")
        for name in DISPLAYS:
            is_green, words = waited_for(getattr(displays, name), lambda green, _: green)
            assert is_green, f"before {state}, {name} does not show a good current field: {words}"
        script.set(state)
        for name in DISPLAYS:
            if (name, state) in NOT_TOLD:
                continue
            looked += 1
            is_told, words = waited_for(getattr(displays, name),
                                        lambda green, words: (not green or (name, state) in FOLLOWING) and
                                        re.search(says, words, re.IGNORECASE))
            told += bool(is_told)
            if not is_told:
                untold.append((state, name, words))
        end = time.monotonic() + LOOK_S
        while time.monotonic() < end:
            for name in DISPLAYS:
                if (name, state) not in NOT_TOLD | FOLLOWING and (found := getattr(displays, name)())[0]:
                    green.append((state, name, found[1]))
    record("displays", "displays and states that were looked at", looked, "shown", None)
    record("displays", "of them told", told, f"= {looked}", told == looked)
    record("displays", "of them that looked good and current", len(green), "= 0", not green)
    wrong = [("not told", *one) for one in untold] + [("green", *one) for one in green]
    assert not wrong, "\n".join(" ".join(one)[-400:] for one in wrong)
