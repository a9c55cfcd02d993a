"""Deviations against allantools, an implementation by others, on the same readings."""

import allantools
import numpy as np
import pytest

import imu_stand

RATE = 20.0
# The same sums in another order: 16 digits less what adding some thousand numbers costs.
RELATIVE = 1e-9


def readings(kind: str) -> np.ndarray:
    rng = np.random.default_rng(7)
    white = rng.normal(size=4096)
    return {"white": white, "walk": np.cumsum(white), "ramp": white + np.linspace(0, 20, white.size)}[kind]


@pytest.mark.parametrize("kind", ["white", "walk", "ramp"])
@pytest.mark.parametrize("deviation", ["adev", "oadev", "mdev", "tdev", "hdev", "ohdev", "totdev"])
def test_a_deviation_is_that_of_allantools(deviation, kind):
    values = readings(kind)
    ours = imu_stand.analyze(values, RATE, deviations=[deviation]).curve("gyro_x", deviation)
    theirs = getattr(allantools, deviation)
    taus, deviations, _, counts = theirs(values, rate=RATE, data_type="freq", taus=ours["tau_s"])
    common = [k for k, tau in enumerate(ours["tau_s"]) if np.any(np.isclose(taus, tau))]
    assert len(common) >= 8, (ours["tau_s"], taus)
    at = [int(np.argmin(np.abs(taus - ours["tau_s"][k]))) for k in common]
    np.testing.assert_allclose(ours["deviation"][common], deviations[at], rtol=RELATIVE)
    assert np.all(ours["low"] < ours["deviation"]) and np.all(ours["deviation"] < ours["high"])


def test_a_deviation_at_all_cluster_times_is_that_of_allantools():
    values = readings("walk")[:512]
    ours = imu_stand.analyze(values, RATE, taus="all").curve("gyro_x")
    taus, deviations, _, _ = allantools.oadev(values, rate=RATE, data_type="freq", taus="all")
    n = min(len(taus), len(ours["tau_s"]))
    assert n > 200
    np.testing.assert_allclose(ours["tau_s"][:n], taus[:n], rtol=1e-12)
    np.testing.assert_allclose(ours["deviation"][:n], deviations[:n], rtol=RELATIVE)


def test_white_noise_has_the_angle_random_walk_that_was_put_in():
    # 0.1 deg/s rms at 20 Hz: N = 0.1 * sqrt(1 / 20) * 60 deg/sqrt(h).
    values = 0.1 * np.random.default_rng(3).normal(size=20_000)
    found = imu_stand.analyze(values, RATE)["channels"]["gyro_x"]["parameters"]["angle_random_walk"]
    expected = 0.1 / np.sqrt(RATE) * 60
    # 20000 readings: 0.5 %; four standard errors.
    assert found["unit"] == "deg/sqrt(h)"
    assert abs(found["value"] / expected - 1) < 0.02
