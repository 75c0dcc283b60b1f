"""A recording that is played with time under control: paused, sought through, faster or slower."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rosglass.bags.player import Player, PlayerState
from rosglass.comm import Handle

if TYPE_CHECKING:
    from collections.abc import Iterable

    from rosglass.bags.bag import Bag
    from rosglass.comm import Node

__all__ = ["Playback"]

#: Times per second that the time is told, where it is.
_CLOCK = 100.0


class Playback(Handle):
    """Plays a recording; at its end it pauses, or begins again.

    Args:
        node: Who publishes.
        bag: The recording, which is closed with this; also when it cannot be played.
        rate: How fast time passes.
        loop: Whether to begin again at the end.
        paused: Whether to begin paused.
        topics: Which topics; empty for all.
        clock: Whether to publish ``/clock``, unless it was recorded.
        delay: Seconds until the first message.
        context: As for :class:`Player`.

    Attributes:
        path: Where the recording is.
        start: When it begins, nanoseconds since the Unix epoch.
        duration: Its length in seconds.
        has_clock: Whether ``/clock`` was recorded.

    Raises:
        BagError: It holds nothing to play, or an argument makes no sense.
    """

    def __init__(
        self,
        node: Node,
        bag: Bag,
        *,
        rate: float = 1.0,
        loop: bool = False,
        paused: bool = False,
        topics: Iterable[str] = (),
        clock: bool = False,
        delay: float = 1.0,
        context: float = 0.0,
    ) -> None:
        self.path, self._bag = bag.path, bag
        self.start, self.duration = bag.start, max(bag.duration, 0.0)
        self.has_clock = any(channel.topic == "/clock" for channel in bag.channels)
        try:
            self._player = Player(
                node,
                bag,
                rate=rate,
                loop=loop,
                paused=paused,
                topics=topics,
                clock=_CLOCK if clock and not self.has_clock else 0.0,
                delay=delay,
                hold=True,
                context=context,
            )
        except BaseException:
            bag.close()
            raise

    @property
    def position(self) -> float:
        """Seconds since the beginning."""
        return self._player.position

    @property
    def moment(self) -> int:
        """The same as recorded: nanoseconds since the Unix epoch."""
        return self._player.moment

    @property
    def played(self) -> float:
        """Seconds that passed for those who watch; see :class:`PlayedTime`."""
        return self._player.played.now()

    @property
    def is_playing(self) -> bool:
        """Whether time passes."""
        running = self._player.status().state in {PlayerState.STARTING, PlayerState.PLAYING}
        return running and not self._player.is_paused

    @property
    def is_at_end(self) -> bool:
        """Whether all was played."""
        return not self.is_playing and self.position >= self.duration

    @property
    def rate(self) -> float:
        """How fast time passes."""
        return self._player.status().rate

    @property
    def loop(self) -> bool:
        """Whether it begins again at the end."""
        return self._player.loop

    @property
    def problem(self) -> str:
        """What is not played, and why; empty when all is."""
        told = dict(self._player.problems)
        parts = [self._bag.problem, *(f"{t}: {why}" if t else why for t, why in told.items())]
        return "; ".join(filter(None, parts))

    def play(self) -> None:
        """Let time pass; from the beginning when the end was reached."""
        self._player.resume()

    def pause(self) -> None:
        """Let time stand still."""
        self._player.pause()

    def seek(self, seconds: float) -> None:
        """Go on at another place; raises BagError when there is none."""
        self._player.seek(seconds)

    def set_rate(self, rate: float) -> None:
        """Let time pass faster or slower; raises BagError."""
        self._player.set_rate(rate)

    def set_loop(self, loop: bool) -> None:
        """Begin again at the end, or pause there."""
        self._player.set_loop(loop)

    def close(self) -> None:
        """Stop; safe to call twice."""
        self._player.close()
        self._bag.close()
