# SPDX-License-Identifier: GPL-3.0-or-later
import dataclasses

import pytest
from conftest import golden

from brainshift import AnswerTime, Currency, Phase, SessionKey, SessionState, codec, frame
from brainshift.currency import LatestUsable, SessionWatch

KEY = SessionKey(7, 1, "model")


def state(newest_update=3, newest_usable=3, **changes):
    value = SessionState(KEY, Phase.TRACKING, newest_update, newest_usable, 100.0, 1000, "", False)
    return dataclasses.replace(value, **changes)


def update(sequence=3, session=KEY):
    usable = codec.update(frame.decode(golden("update_changes")[0]).payload)
    return dataclasses.replace(usable, sequence=sequence, session=session)


@pytest.fixture
def watch():
    watch = SessionWatch()
    watch.asked(1, 10.0)
    watch.answered(1, state())
    return watch


def test_current_until_the_word_ends_counted_from_the_question(watch):
    assert watch.judge(update(), "e", 10.9).currency == Currency.CURRENT
    assert watch.judge(update(), "e", 10.9).age_s == pytest.approx(1.0)
    stale = watch.judge(update(), "e", 11.0)
    assert stale.currency == Currency.STALE and "no word from e for 1.0 s" in stale.reason


def test_stale_before_the_first_answer():
    assert SessionWatch().judge(update(), "e", 0.0).currency == Currency.STALE


def test_an_answer_to_no_known_question_proves_nothing(watch):
    watch.answered(99, state())
    assert watch.judge(update(), "e", 11.5).currency == Currency.STALE
    watch.told(state())
    assert watch.judge(update(), "e", 11.5).currency == Currency.STALE, "a push proves no time"


def test_answers_to_lost_questions_prove_nothing(watch):
    watch.asked(2, 12.0)
    watch.lost()
    watch.answered(2, state())
    assert watch.judge(update(), "e", 12.1).currency == Currency.STALE


def test_superseded_degraded_and_another_session(watch):
    watch.told(state(newest_update=4, newest_usable=4))
    assert watch.judge(update(), "e", 10.1).currency == Currency.SUPERSEDED
    watch.told(state(newest_update=4, reason="no point is inside"))
    degraded = watch.judge(update(), "e", 10.1)
    assert (degraded.currency, degraded.reason) == (Currency.DEGRADED, "no point is inside")
    watch.told(state(session=SessionKey(8, 1, "model")))
    assert watch.judge(update(), "e", 10.1).currency == Currency.NONE


def test_an_old_field_is_aged_then_expired_and_never_current(watch):
    watch.told(state(age_ms=29_500.0, aged_after_ms=30_000, expired_after_ms=30_300))
    assert watch.judge(update(), "e", 10.4).currency == Currency.CURRENT
    aged = watch.judge(update(), "e", 10.6)
    assert (aged.currency, aged.reason) == (Currency.AGED, "its data are 30.1 s old: 30 s at most")
    assert watch.judge(update(), "e", 10.9).currency == Currency.EXPIRED


def test_a_field_newer_than_the_state_is_as_old_as_its_update_says(watch):
    watch.told(state(aged_after_ms=30_000))
    answer = AnswerTime(50.0, 0.0, False, 118_000.0)
    newer = dataclasses.replace(update(4), answer_time=answer, received_s=10.0)
    found = watch.judge(newer, "e", 10.5)
    assert (found.currency, found.age_s) == (Currency.AGED, pytest.approx(118.5))


def test_a_recording_is_told_with_every_status(watch):
    watch.told(state(recorded=True))
    assert watch.judge(update(), "e", 10.1).recorded and watch.judge(update(), "e", 99.0).recorded


def test_another_model_is_named(watch):
    watch.model_id = "mine"
    found = watch.judge(update(), "e", 10.1)
    assert found.currency == Currency.NONE and "load the model anew" in found.reason


def test_the_oldest_question_is_forgotten_first():
    watch = SessionWatch()
    for request in range(1, 70):
        watch.asked(request, float(request))
    watch.answered(1, state())
    assert watch.as_of is None
    watch.answered(69, state())
    assert watch.as_of == 69.0


def test_the_latest_usable_field_is_of_the_running_session_only():
    latest = LatestUsable()
    latest.begin(KEY)
    latest.take(update())
    assert latest.update.sequence == 3
    latest.take(dataclasses.replace(update(4), final=False))
    assert latest.update.sequence == 3, "an iterate replaces nothing"
    latest.take(update(1, SessionKey(7, 2, "model")))
    assert latest.update.session.session_id == 2, "a later session of the same daemon"
    latest.take(update(9, KEY))
    assert latest.update.session.session_id == 2, "an earlier one is over"
    latest.follow(SessionKey(8, 1, "model"))
    assert latest.update is None
