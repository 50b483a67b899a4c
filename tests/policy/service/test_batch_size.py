"""How many calls are worth waiting for: learned from how many came when they were waited for."""

from policy.service.batch_size import Company


def test_one_caller_is_waited_for_once_in_a_while() -> None:
    company = Company()
    waited = []
    for _ in range(600):
        waited.append(company.missing(1))
        company.came(1)
    assert sum(waited) == 2 and not any(waited[:256]), "twice in 600 batches, late"


def test_company_is_found_expected_and_forgotten() -> None:
    company = Company()
    while not company.missing(1):
        company.came(1)
    company.came(5)  # waiting brought four more
    assert company.missing(4) and not company.missing(5)
    company.came(3)
    assert company.missing(4), "one small batch is no reason to give up"
    for _ in range(8):
        company.came(1)
    assert not company.missing(1)
