"""The program's own JSON of the same record: equal keys and equal values."""

import json
import os
import subprocess
from pathlib import Path

import numpy as np
import pytest

import imu_stand

PROGRAM = os.environ.get("IMU_STAND_PROGRAM")
DATA = os.environ.get("IMU_STAND_DATA")


@pytest.fixture
def program(tmp_path):
    if PROGRAM is None:
        pytest.fail("IMU_STAND_PROGRAM is unset: name the program, target/release/imu-stand")

    def called(*words):
        out = tmp_path / "out.json"
        subprocess.run([PROGRAM, *map(str, words), "--json", out, "--quiet"], check=True, cwd=tmp_path)
        return json.loads(out.read_text())

    return called


def test_a_capture_is_analyzed_and_diagnosed_as_by_the_program(program, tmp_path):
    run = imu_stand.simulate(seconds=300, seed=4)
    path = tmp_path / "run.csv.gz"
    run.to_csv(path)
    assert imu_stand.analyze(path) == program("analyze", path)
    assert imu_stand.diagnose(path) == program("diagnose", path)
    assert imu_stand.diagnose(imu_stand.read(path)) == program("diagnose", path)


def test_a_simulation_is_that_of_the_program(program, tmp_path):
    ours, theirs = tmp_path / "ours.csv", tmp_path / "theirs.csv"
    imu_stand.simulate(seconds=60, rate=50, seed=9).to_csv(ours)
    words = ["simulate", "--seconds", "60", "--rate", "50", "--seed", "9", "--out", theirs, "--quiet"]
    subprocess.run([PROGRAM, *map(str, words)], check=True)
    assert ours.read_bytes() == theirs.read_bytes()


def test_arrays_are_what_the_program_reads_from_an_array_file(program, tmp_path):
    rng = np.random.default_rng(11)
    n = 6000
    temperature = 20 + np.linspace(0, 8, n) ** 1.2
    gyro = 0.3 * rng.normal(size=n) - 0.15 * (temperature - 20)
    np.savez(tmp_path / "run.npz", gyro_x=gyro, temp=temperature)
    theirs = program("diagnose", tmp_path / "run.npz", "--rate", "20", "--units", "gyro=deg/s,temp=degC")
    units = {"gyro": "deg/s", "temp": "degC"}
    ours = imu_stand.diagnose({"gyro_x": gyro, "temp": temperature}, 20, units=units, name="run.npz")
    assert ours == theirs
    assert [f["cause"] for f in ours["findings"]] == ["temperature"]
    slope = ours["findings"][0]["parameters"]["slope"]
    assert abs(slope["value"] + 0.15) < 4 * slope["std_error"]


def test_a_plan_is_that_of_the_program(program):
    wish = "K within 20 %, angle within 5 deg after 60 s"
    assert imu_stand.plan(wish, check=0) == program("plan", "--want", wish, "--check", "0")
    causes = ("temperature", "rate_ramp")
    assert imu_stand.plan(separate=causes) == program("plan", "--separate", ",".join(causes))


def test_a_measured_record_is_diagnosed_as_by_the_program(program, tmp_path):
    if DATA is None:
        pytest.skip("IMU_STAND_DATA is unset")
    path = Path(DATA) / "mpu6050_static_20hz_600s.csv.gz"
    columns = "time=time_s,gyro_x=gx_dps,gyro_y=gy_dps,gyro_z=gz_dps,acc_x=ax_mps2,temp=temp_c"
    units = "gyro=deg/s,acc=m/s2,temp=degC"
    ours = imu_stand.diagnose(path, columns=columns, units=units)
    assert ours == program("diagnose", path, "--columns", columns, "--units", units)
    assert imu_stand.analyze(path) == program("analyze", path)
