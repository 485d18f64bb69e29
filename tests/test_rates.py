import numpy as np
import pytest

from quadcurv.convergence import fitted_rate, successive_rates


def test_power_laws_are_recovered() -> None:
    n = np.array([10, 20, 50, 200])
    for rate in (-2.0, 0.0, 1.0, 4.0):
        assert fitted_rate(n, 3 * n**-rate) == pytest.approx(rate, abs=1e-13)
        assert successive_rates(n, 3 * n**-rate) == pytest.approx([rate] * 3, abs=1e-13)


def test_fit_is_least_squares_in_the_logarithms() -> None:
    n, errors = np.array([8, 16, 64, 128]), np.array([1.0, 0.3, 0.02, 0.004])
    assert fitted_rate(n, errors) == pytest.approx(-np.polyfit(np.log(n), np.log(errors), 1)[0])
    assert successive_rates(n, errors)[1] == pytest.approx(np.log(0.3 / 0.02) / np.log(4))


@pytest.mark.parametrize("bad", [0.0, np.nan, np.inf])
def test_zero_or_not_finite_errors_give_nan(bad: float) -> None:
    errors = [1.0, 0.25, bad, 0.01]
    assert np.isnan(fitted_rate([8, 16, 32, 64], errors))
    assert np.isnan(successive_rates([8, 16, 32, 64], errors)).tolist() == [False, True, True]


@pytest.mark.parametrize(
    ("sizes", "errors", "message"),
    [
        ([8, 16], [1.0], r"one length.*got shapes \(2,\) and \(1,\)"),
        ([8], [1.0], "at least two"),
        ([[8, 16]], [[1.0, 2.0]], "one-dimensional"),
        ([8, 8], [1.0, 2.0], "distinct"),
        ([0, 8], [1.0, 2.0], "positive"),
        ([8, np.inf], [1.0, 2.0], "finite"),
        ([8, 16], [1.0, -2.0], "errors must not be negative, got -2"),
    ],
)
def test_rejections(sizes: list, errors: list, message: str) -> None:
    for rates in (fitted_rate, successive_rates):
        with pytest.raises(ValueError, match=message):
            rates(sizes, errors)


def test_arguments_are_not_modified() -> None:
    errors = np.array([1.0, 0.0, 0.1])
    fitted_rate([1, 2, 3], errors)
    assert errors.tolist() == [1.0, 0.0, 0.1]
