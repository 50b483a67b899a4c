"""How many calls are worth waiting for: learned from how many came when they were waited for."""

from policy.service.batch_size import BatchSizePredictor


def test_one_caller_is_waited_for_once_in_a_while() -> None:
    predictor = BatchSizePredictor()
    waited = []
    for _ in range(600):
        waited.append(predictor.expects_more_than(1))
        predictor.observe(1)
    assert sum(waited) == 2 and not any(waited[:256]), "twice in 600 batches, late"


def test_the_predicted_batch_size_follows_the_clients() -> None:
    predictor = BatchSizePredictor()
    while not predictor.expects_more_than(1):
        predictor.observe(1)
    predictor.observe(5)  # waiting brought four more
    assert predictor.expects_more_than(4) and not predictor.expects_more_than(5)
    predictor.observe(3)
    assert predictor.expects_more_than(4), "one small batch is no reason to give up"
    for _ in range(8):
        predictor.observe(1)
    assert not predictor.expects_more_than(1)
