"""Look at the first and the last messages of many streams of a bag together: a bag may have thousands of topics."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable

from agent.recordings.bag_reader import Bag, Message, Stream

_FIRST_REACH = 0.1  # s; last messages are looked for so far before the bag's end, then further
_GROWTH = 10.0
_MOST_UNNEEDED = 8_000_000  # bytes


def look_at_first(bag: Bag, streams: Iterable[Stream], enough: Callable[[Message], bool]) -> None:
    """Give the messages of each stream from the first on to `enough`, until it returns true for the stream.

    All streams are read at once. Whenever half of those that are read have enough, or much of them was read for
    nothing, reading goes on at the same moment without them: pictures are not read on and on until a rare topic says
    something.

    Args:
        bag: open.
        streams: of it.
        enough: takes a message, and returns whether its stream needs no further one.

    Raises:
        BadInput: if the bag is damaged.
    """
    waiting = {stream for stream in streams if stream.count}
    start: int | None = None
    seen: Counter[Stream] = Counter()  # of the moment at which reading goes on
    while waiting:
        at_first, unneeded, again = len(waiting), 0, Counter(seen)
        for message in bag.messages(sorted(waiting, key=str), start):
            stream = message.stream
            if message.recorded == start and again[stream]:
                again[stream] -= 1
                continue
            if message.recorded != start:
                start, seen, again = message.recorded, Counter(), Counter()
            seen[stream] += 1
            if stream not in waiting:
                unneeded += len(message.raw)
            elif enough(message):
                waiting.discard(stream)
            if 2 * len(waiting) <= at_first or unneeded > _MOST_UNNEEDED:
                break
        else:
            return


def first_times(bag: Bag, streams: Iterable[Stream]) -> dict[Stream, int]:
    """Return when the first message of each stream was recorded, nanoseconds; streams without one are left out."""
    found: dict[Stream, int] = {}

    def enough(message: Message) -> bool:
        found[message.stream] = message.recorded
        return True

    look_at_first(bag, streams, enough)
    return found


def last_times(bag: Bag, first: dict[Stream, int]) -> dict[Stream, int]:
    """Return when the last message of each stream was recorded, nanoseconds.

    Args:
        bag: open.
        first: when the first message of each was recorded.
    """
    last = {stream: time for stream, time in first.items() if stream.count == 1}
    reach = _FIRST_REACH
    while waiting := [stream for stream in first if stream not in last]:
        start = max(min(first[stream] for stream in waiting), bag.end - round(reach * 1e9))
        for message in bag.messages(waiting, start):
            last[message.stream] = message.recorded
        if start <= min(first[stream] for stream in waiting):
            return first | last
        reach *= _GROWTH
    return last
