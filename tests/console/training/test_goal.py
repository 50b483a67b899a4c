"""Progress towards the limits of a training, and the time left."""

from console.training.goal import Goal, duration, remaining, stage


def test_time_to_go_follows_the_nearest_limit() -> None:
    goal = Goal(iterations=100, samples=1000)
    metrics = {"iteration": 10.0, "samples": 500.0, "seconds": 30.0}
    # Half of the samples in 30 s: half a minute to go, though 90 iterations are left.
    assert remaining(goal, metrics, (0.0, 0.0)) == "0:30"
    assert remaining(Goal(), metrics, (0.0, 0.0)) == "-"
    # ten minutes more, of which one is over, in a run that had counted an hour
    timed = Goal(seconds=600.0).after(3600.0)
    since = (timed.fraction(0, 0, 3600.0), 3600.0)
    assert remaining(timed, {"seconds": 3660.0}, since) in ("8:59", "9:00")


def test_durations() -> None:
    assert (duration(3723.9), duration(123), duration(0)) == ("1:02:03", "2:03", "0:00")


def test_the_stage_names_the_iteration_at_hand_and_the_time_left() -> None:
    assert stage(Goal(), {}, "-") == "iteration 1"
    done = {"iteration": 4.0, "samples": 100.0}
    assert stage(Goal(iterations=10), done, "0:30") == "iteration 5, 40% done, to go 0:30"
