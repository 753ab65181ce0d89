"""Who drives, what a new viewer gets, and how much waits for a slow one."""

import asyncio
import json

from agent.live_view.viewers import MOST_LINES, Viewers


def seats(viewers) -> list[str]:
    return [roles["driver"] for _, roles in sorted(viewers.roles().items())]


def waiting(viewer) -> list[str]:
    return asyncio.run(viewer.messages())


def after_the_first(viewer) -> list[str]:
    """What waits after the greeting of a new viewer."""
    return waiting(viewer)[1:]


def test_the_first_page_drives_and_the_others_watch():
    viewers = Viewers(drivable=True)
    first, second = viewers.add(drives=True), viewers.add(drives=True)
    assert seats(viewers) == ["you", "other"]
    assert viewers.drives(first) and not viewers.drives(second)


def test_taking_over_is_explicit_and_leaves_the_driver_watching():
    viewers = Viewers(drivable=True)
    first, second = viewers.add(drives=True), viewers.add(drives=True)
    viewers.take_over(second)
    assert seats(viewers) == ["other", "you"]
    viewers.remove(second)
    assert seats(viewers) == ["nobody"], "nobody is moved to the driver's seat unasked"
    viewers.take_over(first)
    assert seats(viewers) == ["you"]


def test_a_page_that_comes_back_takes_no_empty_seat():
    viewers = Viewers(drivable=True)
    viewers.add(drives=False)
    assert seats(viewers) == ["nobody"]
    viewers.add(drives=True)
    assert seats(viewers) == ["other", "you"]


def test_who_has_left_cannot_take_over():
    viewers = Viewers(drivable=True)
    gone = viewers.add(drives=True)
    viewers.remove(gone)
    viewers.take_over(gone)
    assert not viewers.drives(gone)


def test_beside_a_terminal_nobody_drives():
    viewers = Viewers(drivable=False)
    page = viewers.add(drives=True)
    viewers.take_over(page)
    assert seats(viewers) == ["terminal"] and not viewers.drives(page)


def test_a_new_viewer_gets_the_last_message_of_each_kind_and_the_last_lines():
    viewers = Viewers(drivable=True)
    for number in range(MOST_LINES + 7):
        viewers.tell_all("entry", json.dumps(number))
    viewers.tell_all("scene", "old scene")
    viewers.tell_all("candidates", "of the old scene")
    viewers.tell_all("poses", "of the old scene")
    viewers.tell_all("scene", "new scene")
    viewers.tell_all("poses", "first")
    viewers.tell_all("poses", "last")
    hello, *got = waiting(viewers.add(drives=True))
    assert json.loads(hello)["kind"] == "hello"
    assert got == [*(str(number) for number in range(7, MOST_LINES + 7)), "new scene", "last"]


def test_of_what_a_slow_viewer_has_not_read_only_the_last_of_each_kind_waits():
    viewers = Viewers(drivable=True)
    slow = viewers.add(drives=True)
    for number in range(10_000):
        viewers.tell_all("poses", f"poses {number}")
        viewers.tell_all("progress", f"progress {number}")
    assert not slow.overrun
    assert after_the_first(slow) == ["poses 9999", "progress 9999"]


def test_a_viewer_that_reads_nothing_is_given_up():
    viewers = Viewers(drivable=True)
    slow = viewers.add(drives=True)
    for number in range(2 * MOST_LINES):
        assert not slow.overrun
        viewers.tell_all("entry", str(number))
    assert slow.overrun


def test_the_order_of_messages_is_kept():
    viewers = Viewers(drivable=True)
    page = viewers.add(drives=True)
    for kind in ("scene", "entry", "poses", "scene", "entry", "poses"):
        viewers.tell_all(kind, kind)
    assert after_the_first(page) == ["entry", "scene", "entry", "poses"]


def test_another_start_greets_with_another_name():
    greetings = [json.loads(waiting(Viewers(drivable=True).add(drives=True))[0]) for _ in range(2)]
    assert [one["kind"] for one in greetings] == ["hello", "hello"]
    assert greetings[0]["start"] != greetings[1]["start"]
