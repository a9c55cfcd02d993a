"""A fleet's captures: one row each and channel, the same on a cluster that loses a worker as one after the other."""

import json
import os
import resource
import signal
import time

import dask
import dask.dataframe
import distributed
import numpy as np
import pandas as pd
import pytest

import imu_stand
from imu_stand import fleet

RATE = 20.0
UNITS = {"gyro": "deg/s", "temp": "degC"}
OPTIONS = {"rate": RATE, "units": UNITS, "replicates": 0, "allan": False}


def capture(number, seconds=60, warm=False):
    """A gyro at rest; one that follows its temperature where ``warm``."""
    rng = np.random.default_rng([20261124, number])
    n = int(seconds * RATE)
    temp = 25 + 6 * np.sin(2 * np.pi * np.arange(n) / n + rng.uniform(0, 6))
    gyro = 0.1 + rng.uniform(0.35, 0.45) * rng.normal(size=n) + (0.2 * (temp - 25) if warm else 0)
    return pd.DataFrame({"capture": f"unit{number:04}", "gyro_x": gyro, "temp": temp})


def together(table):
    return table.sort_values(["capture", "channel"], ignore_index=True)


def test_a_frame_of_captures_is_a_table_of_rows():
    frame = pd.concat([capture(k, 300, warm=k % 2 == 1) for k in range(4)])
    short = capture(9).head(3)
    table = fleet.diagnose_frame(pd.concat([frame, short]), rate=RATE, units=UNITS, replicates=19)
    assert list(table.columns) == list(fleet.EMPTY.columns)
    assert (table.dtypes == fleet.EMPTY.dtypes).all()
    assert list(table["capture"]) == ["unit0000", "unit0001", "unit0002", "unit0003", "unit0009"]
    assert list(table["causes"]) == ["", "temperature", "", "temperature", ""]
    assert list(table["material"]) == [0, 1, 0, 1, 0]
    assert table["error"].iloc[-1] and not table["error"].iloc[:-1].any()
    row = table.iloc[1]
    alone = imu_stand.diagnose(
        capture(1, 300, warm=True).drop(columns="capture"), RATE, units=UNITS, replicates=19, name="unit0001"
    )
    assert row["n"] == alone["extended"]["gyro_x"]["angle_random_walk"]["value"]
    assert row["p_after"] == alone["replicates"]["gyro_x"]["after"]["p_value"]
    (finding,) = json.loads(row["findings"])
    assert finding["parameters"] == alone["findings"][0]["parameters"]
    assert row["angle_10s_deg"] == alone["findings"][0]["consequence"]["angle_rms_deg"]["10s"] > 1
    # 300 s hold too few angles of 100 s: not known is not 0.
    assert np.isnan(row["angle_100s_deg"]) and table["angle_100s_deg"].iloc[0] == 0
    of = fleet.causes(table)
    assert list(of["cause"]) == ["temperature"] and of["captures"].iloc[0] == 2 and of["share"].iloc[0] == 0.5
    assert 0.14 < of["low"].iloc[0] < 0.16 and 0.84 < of["high"].iloc[0] < 0.86


def test_a_column_that_is_not_there_is_named_with_those_that_are():
    with pytest.raises(imu_stand.Error, match="no column device in the frame; it has capture, gyro_x, temp"):
        fleet.diagnose_frame(capture(1), by="device")


def test_pooling_has_the_mean_and_the_scatter_that_were_drawn():
    rng = np.random.default_rng(3)
    count = 400
    errors = rng.uniform(0.05, 0.3, count)
    values = rng.normal(5.0, 0.4, count) + errors * rng.normal(size=count)
    rows = {"capture": [f"{k}" for k in range(count)], "channel": "gyro_x", "error": "", "n": values, "n_error": errors}
    table = pd.DataFrame(rows).reindex(columns=fleet.EMPTY.columns)
    (pooled,) = fleet.pool(table).to_dict("records")
    assert pooled["figure"] == "n" and pooled["captures"] == count
    assert pooled["low"] < 5.0 < pooled["high"] and pooled["high"] - pooled["low"] < 0.1
    # The standard error of a scatter over 400 is 3.5 % and what the errors add.
    assert abs(pooled["scatter"] / 0.4 - 1) < 0.15
    nearest = fleet.representative(table)
    assert len(nearest) == count and nearest["odd"].sum() <= 2
    loud = table.assign(n=np.where(table["capture"] == "7", 9.0, table["n"]))
    odd = fleet.representative(loud)
    assert list(odd[odd["odd"]]["capture"])[-1] == "7" and odd["by"].iloc[-1] == "n of gyro_x"
    assert abs(table.set_index("capture").loc[nearest["capture"].iloc[0], "n"] - 5.0) < 0.1


def test_a_thousand_captures_on_a_cluster_that_loses_a_worker_are_those_of_one_process(tmp_path, capsys):
    files, each = 40, 25
    for file in range(files):
        numbers = range(each * file, each * (file + 1))
        frame = pd.concat([capture(k, warm=k % 10 == 0) for k in numbers])
        frame.to_parquet(tmp_path / f"part{file:02}.parquet", index=False)
    start = time.perf_counter()
    parts = sorted(tmp_path.iterdir())
    serial = pd.concat([fleet.diagnose_frame(pd.read_parquet(part), **OPTIONS) for part in parts])
    alone = time.perf_counter() - start
    start = time.perf_counter()
    settings = {"distributed.scheduler.allowed-failures": 10, "distributed.worker.daemon": True}
    with (
        dask.config.set(settings),
        distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None, host="127.0.0.1") as cluster,
        distributed.Client(cluster) as client,
    ):
        data = dask.dataframe.read_parquet(tmp_path, split_row_groups=False, aggregate_files=False)
        mapped = data.map_partitions(fleet.diagnose_frame, meta=fleet.EMPTY, **OPTIONS)
        assert mapped.npartitions == files
        futures = client.compute(mapped.to_delayed())
        distributed.wait(futures[:4])
        victim = client.run(os.getpid)
        os.kill(next(iter(victim.values())), signal.SIGKILL)
        spread = pd.concat(client.gather(futures))
    cluster_took = time.perf_counter() - start
    pd.testing.assert_frame_equal(together(spread), together(serial))
    assert len(serial) == 1000 and not serial["error"].any()
    named = serial[serial["causes"].str.contains("temperature")]
    assert {int(name[4:]) % 10 for name in named["capture"]} == {0} and len(named) >= 95
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    with capsys.disabled():
        print(
            f"\n1000 captures of 60 s at 20 Hz: one process {1000 / alone:.0f} a second, peak {peak:.0f} MiB; "
            f"2 workers, one of them killed on the way, start included, {1000 / cluster_took:.0f} a second"
        )
