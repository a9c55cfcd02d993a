"""What a user of the package meets: data of every kind, errors that say what to do, threads, notebooks."""

import pickle
import subprocess
import sys
import threading
import time

import numpy as np
import pytest

import imu_stand

RATE = 20.0


def white(n=6000, seed=1):
    return 0.3 * np.random.default_rng(seed).normal(size=n)


def test_arrays_dicts_and_data_frames_are_one():
    pandas = pytest.importorskip("pandas")
    gyro = white()
    units = {"gyro": "deg/s"}
    of_array = imu_stand.analyze(gyro, RATE, units=units)
    assert of_array == imu_stand.analyze({"gyro_x": gyro}, RATE, units=units)
    assert of_array == imu_stand.analyze(gyro[:, None], RATE, units=units)
    assert of_array == imu_stand.analyze(list(gyro), RATE, units=units)
    assert of_array == imu_stand.analyze(pandas.DataFrame({"gyro_x": gyro}), RATE, units=units)
    assert list(imu_stand.analyze(np.stack([gyro] * 3, 1), RATE)["channels"]) == ["gyro_x", "gyro_y", "gyro_z"]
    # Times: as a column of dates, as an index of dates, in s.
    dates = pandas.date_range("2026-01-01", periods=gyro.size, freq="50ms")
    frame = pandas.DataFrame({"stamp": dates, "wx": gyro})
    columns = {"time": "stamp", "gyro_x": "wx"}
    by_dates = imu_stand.analyze(frame, columns=columns, units={"gyro": "deg/s", "time": "s"})
    by_index = imu_stand.analyze(pandas.DataFrame({"gyro_x": gyro}, index=dates), units=units)
    for other in (by_dates, by_index):
        assert other["input"]["rate_hz"] == pytest.approx(RATE)
        deviations = [a["channels"]["gyro_x"]["deviations"] for a in (other, of_array)]
        assert deviations[0]["oadev"][0]["deviation"] == deviations[1]["oadev"][0]["deviation"]


def test_pandas_is_not_needed():
    script = "import sys, imu_stand; imu_stand.analyze([0.1, 0.2, 0.4] * 50, 20); assert 'pandas' not in sys.modules"
    subprocess.run([sys.executable, "-c", script], check=True)


def test_units_are_taken_and_other_quantities_are_analyzed():
    gyro = white()
    in_rad = imu_stand.analyze(np.deg2rad(gyro), RATE, units={"gyro": "rad/s"})
    in_deg = imu_stand.analyze(gyro, RATE, units="gyro=deg/s")
    sizes = [a["channels"]["gyro_x"]["parameters"]["angle_random_walk"]["value"] for a in (in_rad, in_deg)]
    assert sizes[0] == pytest.approx(sizes[1], rel=1e-9)
    oscillator = imu_stand.analyze({"freq": gyro}, 1, units={"freq": "1"})
    assert oscillator["channels"]["freq"]["unit"] == "1"


def test_a_record_is_a_mapping_of_arrays_that_cannot_be_written_to(tmp_path):
    run = imu_stand.simulate(seconds=30, seed=2)
    assert run["gyro_x"].shape == run["time"].shape == (600,)
    assert run.units["gyro_x"] == "deg/s" and run.units["time"] == "s"
    assert run.header["simulated"] == "imu-stand simulate"
    with pytest.raises(ValueError):
        run["gyro_x"][0] = 1.0
    run.to_csv(tmp_path / "run.csv")
    again = imu_stand.read(tmp_path / "run.csv")
    assert list(again) == list(run)
    for name in run:
        # A file holds counts: scaled again, the last digit may be another.
        np.testing.assert_allclose(again[name], run[name], rtol=1e-15, atol=1e-12)
    same = imu_stand.simulate(seconds=30, seed=2)
    np.testing.assert_array_equal(same["gyro_x"], run["gyro_x"])


def test_channels_that_are_named_are_diagnosed_and_no_others():
    data = {"gyro_x": white(2400), "gyro_y": white(2400), "acc_x": white(2400)}
    units = {"gyro": "deg/s", "acc": "m/s2"}
    both = imu_stand.diagnose(data, RATE, units=units, channels=["gyro_x", "acc_x"], replicates=0)
    assert set(both["baseline"]) == {"gyro_x", "acc_x"}
    with pytest.raises(imu_stand.Error, match="acc_z"):
        imu_stand.diagnose(data, RATE, units=units, channels=["acc_z"])


def test_a_diagnosis_shows_itself_and_its_model_simulates():
    n = 6000
    temperature = 20 + 8 * (1 - np.exp(-np.arange(n) / 1200))
    data = {"gyro_x": white(n) - 0.2 * temperature, "temp": temperature}
    diagnosis = imu_stand.diagnose(data, RATE, units={"gyro": "deg/s", "temp": "degC"}, name="<b>")
    assert diagnosis["format"] == "imu-stand-diagnosis/1" and diagnosis["verdict"] == "extended"
    # What a shell is told, of options of the command, is not said here; a size stands once, with its interval of 95 %.
    assert "verdict  extended" in str(diagnosis) and "--details" not in str(diagnosis)
    html = diagnosis._repr_html_()
    assert "+-" not in html and "warm_up" in html
    # The verdict stands there in the words of the program; what is too small to matter says so.
    assert "Diagnosis: extended: the simulation lacks" in html and "too small to matter" not in html
    diagnosis["findings"][0]["material"] = False
    assert html != diagnosis._repr_html_() and "(too small to matter)" in diagnosis._repr_html_()
    diagnosis["findings"][0]["material"] = True
    assert "temperature" in html and "deg/s/degC" in html and "<b>:" not in html and "&lt;b&gt;" in html
    report = diagnosis.report_html()
    assert report.startswith("<!DOCTYPE html>") and "Bias follows temperature" in report
    model = imu_stand.simulate(diagnosis, seconds=60)
    assert model["gyro_x"].size == 1200
    sent = pickle.loads(pickle.dumps(diagnosis))
    assert sent == diagnosis and str(sent) == str(diagnosis) and sent.model == diagnosis.model
    with pytest.raises(imu_stand.Error, match="make the report where"):
        sent.report_html()


def test_analysis_and_plan_show_themselves():
    analysis = imu_stand.analyze(white(), RATE)
    assert "deg/sqrt(h)" in analysis._repr_html_()
    assert "gyro_x  N " in str(analysis) and str(analysis).count("\n") < 20 and "--" not in str(analysis)
    plan = imu_stand.plan("K within 20 %, angle within 5 deg after 60 s", separate="temperature,rate_ramp", check=0)
    assert "K within 20 %" in plan._repr_html_() and "temperature against rate_ramp" in plan._repr_html_()


GYRO = white(2000)
ERRORS = [
    (lambda: imu_stand.analyze(GYRO), "sample rate is unknown", "`rate=HZ`"),
    (lambda: imu_stand.analyze(GYRO, -1), "rate", "above 0"),
    (lambda: imu_stand.diagnose(GYRO[:5], RATE), "needs 600 samples", "record for longer"),
    (lambda: imu_stand.diagnose({"a": GYRO}, RATE), "the record has: a", 'columns="gyro_x=a"'),
    (lambda: imu_stand.diagnose(np.zeros((5, 7)), RATE), "(5, 7)", "shape (n,)"),
    (lambda: imu_stand.diagnose({"gyro_x": GYRO, "temp": GYRO[:5]}, RATE), "temp 5", "one number a sample"),
    (lambda: imu_stand.diagnose({"gyro_x": ["a"] * 5}, RATE), "real numbers", "leave it out"),
    (lambda: imu_stand.diagnose(GYRO, RATE, base="upside down"), "upside down", "turntable"),
    (lambda: imu_stand.diagnose(GYRO, RATE, replicates=3), "19", "replicates=0"),
    (lambda: imu_stand.analyze(GYRO, RATE, deviations="foo"), "foo", "oadev"),
    (lambda: imu_stand.analyze(GYRO, RATE, channels=["gyro_z"]), "gyro_z", "gyro_x"),
    (lambda: imu_stand.analyze(GYRO, RATE, columns="gyro_x"), "`gyro_x`", "gyro_x=gx"),
    (lambda: imu_stand.analyze(GYRO, RATE, units={"gyro": "furlong"}), "furlong", "deg/s"),
    (lambda: imu_stand.plan(), "nothing to plan", 'want="K within 20 %"'),
    (lambda: imu_stand.plan("K 20"), "`K 20`", 'want="K within 20 %"'),
    (lambda: imu_stand.simulate(seconds=-1), "-1 s", "`seconds`"),
    (lambda: imu_stand.simulate("a\nb"), "line 1", "docs/model-file.md"),
]


@pytest.mark.parametrize("call, said, help", ERRORS)
def test_an_error_says_what_was_found_and_what_to_do(call, said, help):
    with pytest.raises(imu_stand.Error) as raised:
        call()
    message = str(raised.value)
    assert said in message and help in message and "--" not in message, message
    assert isinstance(raised.value, ValueError)


def test_a_file_that_is_not_there_is_named():
    with pytest.raises(FileNotFoundError, match="nowhere.csv"):
        imu_stand.diagnose("nowhere.csv")


def test_other_threads_run_while_it_computes():
    long = white(400_000)
    done = threading.Event()

    def compute():
        imu_stand.diagnose(long, RATE, replicates=0)
        done.set()

    thread = threading.Thread(target=compute)
    begun = time.perf_counter()
    thread.start()
    longest, last = 0.0, time.perf_counter()
    while not done.is_set():
        time.sleep(0.001)
        longest, last = max(longest, time.perf_counter() - last), time.perf_counter()
    thread.join()
    took = time.perf_counter() - begun
    # With the lock held, one look would take as long as the whole; half leaves room for a busy machine.
    assert longest < took / 2, (longest, took)


def test_a_file_of_two_rates_is_refused_and_a_span_takes_one(tmp_path):
    gyro = white(1200)
    time = np.r_[np.arange(601) * 0.05, 30 + np.arange(1, 600) * 0.01]
    path = tmp_path / "joined.csv"
    np.savetxt(path, np.c_[time, gyro], delimiter=",", header="time_s,gyro_x", comments="")
    with pytest.raises(imu_stand.Error, match=r"`span=\(None, 30.000000\)` or `span=\(30.000000, None\)`"):
        imu_stand.analyze(path, units="gyro=deg/s")
    first = imu_stand.read(path, units="gyro=deg/s", span=(None, 30))
    assert first["gyro_x"].shape == (601,) and any("span" in note for note in first.notes)
    assert imu_stand.analyze(first)["input"]["rate_hz"] == pytest.approx(20)
    with pytest.raises(imu_stand.Error, match="the later one second"):
        imu_stand.read(path, units="gyro=deg/s", span=(30, 10))
