"""The samples of a plotted line, and their extremes in columns."""

from __future__ import annotations

import numpy as np
import pytest

from rosglass.controls.plots.samples import BLOCK_SIZE, MAX_RUNS, Columns, Samples

SECOND = 1_000_000_000
MS = 1_000_000


def filled(count: int, step: int = MS, start: int = 0) -> tuple[Samples, np.ndarray, np.ndarray]:
    """Return samples of a random walk, added in batches, and their times and values."""
    times = start + np.arange(count, dtype=np.int64) * step
    values = np.random.default_rng(1).normal(size=count).cumsum()
    samples = Samples()
    for at in range(0, count, 1013):
        samples.add(times[at : at + 1013], values[at : at + 1013])
    return samples, times, values


def extremes(samples: Samples, start: int, step: int, count: int) -> tuple[np.ndarray, np.ndarray]:
    low, high = np.empty((2, count))
    samples.reduce(low, high, start, step)
    return low, high


def test_samples_are_kept_as_they_were_added() -> None:
    samples, times, values = filled(3 * BLOCK_SIZE + 17)
    (run,) = samples.runs()
    assert np.array_equal(run[0], times)
    assert np.array_equal(run[1], values)
    assert len(samples) == len(times)


def test_memory_is_little_more_than_that_of_times_and_values() -> None:
    samples, times, _ = filled(600_000)
    assert samples.nbytes < 1.2 * 16 * len(times)


@pytest.mark.parametrize("step", [MS // 2, 3 * MS, 50 * MS, 750 * MS, 9 * SECOND])
def test_extremes_are_those_of_the_samples_in_each_column(step: int) -> None:
    samples, times, values = filled(200_000)
    start, count = 12_345 * MS, 400
    low, high = extremes(samples, start, step, count)
    # Chunks are assigned as a whole: half a column more or less.
    slack = step // 2
    for column in range(count):
        begin, end = start + column * step, start + (column + 1) * step
        wide = values[(times >= begin - slack) & (times < end + slack)]
        tight = values[(times >= begin + slack) & (times < end - slack)]
        if not len(wide):
            assert low[column] == np.inf
        elif len(tight):
            assert wide.min() <= low[column] <= tight.min()
            assert tight.max() <= high[column] <= wide.max()
    inside = (times >= start) & (times < start + step * count)
    assert low.min() == values[inside].min()
    assert high.max() == values[inside].max()


@pytest.mark.parametrize("usual", [1, 2, 3, 6, 17])
def test_extremes_of_bursts_and_silence_are_exact(usual: int) -> None:
    random, count, step = np.random.default_rng(usual), 300, SECOND
    lengths = usual + random.integers(0, 2, count)
    others = random.integers(0, count, 60)
    lengths[others] = random.integers(0, 40, 60)
    column = np.repeat(np.arange(count), lengths)
    times = np.sort(column * step + random.integers(0, step, len(column)))
    values = random.normal(size=len(times))
    values[random.integers(0, len(values), 50)] = np.nan
    samples = Samples()
    samples.add(times, values)
    low, high = extremes(samples, 0, step, count)
    for at in range(count):
        own = values[column == at]
        expected = (np.inf, -np.inf)
        if len(own):
            expected = np.fmin.reduce(own), np.fmax.reduce(own)
        assert np.array_equal((low[at], high[at]), expected, equal_nan=True)


def test_one_spike_is_seen_at_any_zoom() -> None:
    samples, times, _ = filled(300_000)
    samples.add(times[-1:] + MS, np.array([1e9]))
    samples.add(times[-1:] + 2 * MS, np.array([0.0]))
    for step in (MS, 100 * MS, 10 * SECOND, 400 * SECOND):
        assert extremes(samples, 0, step, 301 * SECOND // step + 1)[1].max() == 1e9


def test_late_samples_are_put_in_order() -> None:
    samples = Samples()
    order = np.random.default_rng(2).permutation(5000)
    # No sample is later than a second.
    order = np.array(sorted(range(5000), key=lambda at: at + order[at] % 900))
    times = order.astype(np.int64) * MS
    for at in range(0, 5000, 37):
        samples.add(times[at : at + 37], times[at : at + 37] * 2.0)
    (run,) = samples.runs()
    assert np.array_equal(run[0], np.arange(5000) * MS)
    assert np.array_equal(run[1], run[0] * 2.0)
    assert samples.restarts == 0


def test_late_sample_reaches_back_into_the_block_before() -> None:
    samples, times, values = filled(BLOCK_SIZE + 3)
    samples.add(np.array([times[-10] + 1]), np.array([1e6]))
    (run,) = samples.runs()
    assert np.array_equal(run[0], np.insert(times, -9, times[-10] + 1))
    assert np.array_equal(run[1], np.insert(values, -9, 1e6))
    assert extremes(samples, 0, 10 * SECOND, 10)[1].max() == 1e6


def test_new_run_begins_when_time_goes_back() -> None:
    samples = filled(10_000)[0]
    samples.add(np.array([0, MS, 2 * MS]), np.array([1.0, 2.0, 3.0]))
    assert samples.restarts == 1
    assert samples.span == (0, 2 * MS)
    assert [len(run[0]) for run in samples.runs()] == [10_000, 3]


def test_time_may_go_back_within_a_batch() -> None:
    samples = Samples()
    samples.add(np.array([100, 101, 3, 4]) * SECOND, np.array([1.0, 2.0, 3.0, 4.0]))
    assert [run[1].tolist() for run in samples.runs()] == [[1.0, 2.0], [3.0, 4.0]]


def test_runs_are_limited() -> None:
    samples = Samples()
    for at in range(100):
        samples.add(np.array([(at % 2) * 100 * SECOND]), np.array([0.0]))
    assert len(samples.runs()) == MAX_RUNS
    assert len(samples) + samples.removed == 100


def test_old_samples_are_dropped_in_blocks_and_counted() -> None:
    samples, times, _ = filled(4 * BLOCK_SIZE)
    samples.forget(int(times[2 * BLOCK_SIZE + 5]), 10**9)
    assert samples.removed == 2 * BLOCK_SIZE
    assert len(samples) == 2 * BLOCK_SIZE
    samples.forget(-1, BLOCK_SIZE)
    assert len(samples) == BLOCK_SIZE


def test_columns_without_numbers_differ_from_empty_ones() -> None:
    samples = Samples()
    samples.add(np.array([0, 10, 20, 30]), np.array([np.nan, 1.0, np.nan, np.inf]))
    low, high = extremes(samples, 0, 5, 8)
    assert np.isnan(low[[0, 4]]).all()
    assert low[2] == high[2] == 1.0
    assert low[6] == high[6] == np.inf
    assert (low[1::2] > high[1::2]).all()
    low, high = extremes(samples, 0, 100, 1)
    assert (low[0], high[0]) == (1.0, np.inf)


def test_times_beyond_all_clocks_are_limited() -> None:
    samples = Samples()
    samples.add(np.array([np.iinfo(np.int64).max]), np.array([1.0]))
    samples.add(np.array([np.iinfo(np.int64).min]), np.array([1.0]))
    assert samples.restarts == 1


def test_gap_follows_the_usual_pause() -> None:
    slow, fast = filled(100, 3 * SECOND)[0], filled(100)[0]
    assert fast.gap_ns == SECOND
    assert slow.gap_ns == pytest.approx(15 * SECOND)


def test_neighbours_of_a_time() -> None:
    samples, times, values = filled(BLOCK_SIZE + 100)
    middle = int(times[BLOCK_SIZE - 1]) + MS // 2
    assert samples.before(middle) == (times[BLOCK_SIZE - 1], values[BLOCK_SIZE - 1])
    assert samples.after(middle) == (times[BLOCK_SIZE], values[BLOCK_SIZE])
    assert samples.before(-1) is None
    assert samples.after(int(times[-1])) is None


@pytest.mark.parametrize("seed", range(20))
def test_columns_that_scroll_are_those_computed_anew(seed: int) -> None:
    random = np.random.default_rng(seed)
    lines = [Samples() for _ in range(3)]
    columns, count, step, first, now = Columns(), 100, 10 * MS, 0, 0
    for _ in range(60):
        for line in lines:
            size = int(random.integers(0, 40))
            late = int(random.integers(0, 600)) * MS if random.random() < 0.2 else 0
            times = now - late + np.arange(size) * MS
            line.add(times, random.normal(size=size))
        now += 40 * MS
        first += int(random.integers(-3, 8))
        before = columns.low.copy()
        moved = first - columns.first
        changed = columns.update(lines, first, step, count)
        for row, line in enumerate(lines):
            low, high = extremes(line, first * step, step, count)
            assert np.array_equal(columns.low[row], low)
            assert np.array_equal(columns.high[row], high)
        if 0 <= moved < count and before.shape == columns.low.shape and changed:
            assert np.array_equal(before[:, moved : moved + changed], columns.low[:, :changed])


def test_bins_keep_their_extremes_in_order() -> None:
    times = np.arange(10_007, dtype=np.int64) * 1000
    values = np.sin(times / 1e5)
    values[[17, 8_888]] = 9.0, -9.0
    values[500:600] = np.nan
    samples = Samples(bin_ns=50_000)
    for at in range(0, len(times), 333):
        samples.add(times[at : at + 333], values[at : at + 333])
    kept_times, kept = samples.runs()[0]
    bins = 10_007 // 50 + 1
    # Of a bin that two additions share, up to four are kept.
    assert bins <= len(samples) <= 2 * bins + 4 * (10_007 // 333 + 1)
    assert samples.merged + len(samples) == 10_007
    assert (np.nanmax(kept), np.nanmin(kept)) == (9.0, -9.0)
    assert np.isnan(kept).any()
    assert (np.diff(kept_times) > 0).all()
    # As dense at the beginning as at the end.
    assert abs(int((kept_times < 5_000_000).sum()) - len(kept) / 2) < 20
    for at in range(0, 10_007, 50):
        here = (kept_times >= at * 1000) & (kept_times < (at + 50) * 1000)
        expected = values[at : at + 50]
        if not np.isnan(expected).any():
            assert (kept[here].min(), kept[here].max()) == (expected.min(), expected.max())


def test_curves_in_bins_keep_pairs() -> None:
    times = np.arange(1000, dtype=np.int64)
    across, along = Samples(10, extremes=False), Samples(10, extremes=False)
    across.add(times, times / 2.0)
    along.add(times, -times / 1.0)
    assert (across.runs()[0][0] == along.runs()[0][0]).all()
    assert len(across) == 100
