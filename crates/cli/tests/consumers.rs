//! What `imu-stand export` writes, read by the consumers' own parsers in Python: PyYAML, numpy, pyarrow, and the XML parser of
//! the standard library.
//!
//! They run where an interpreter has these packages: the one that IMU_STAND_PYTHON names, which then has to have them; else
//! `target/python/bin/python` or `python3`, and where a package is missing the test says that it did not run:
//!
//! ```sh
//! python3 -m venv target/python && target/python/bin/pip install pyyaml numpy pyarrow
//! ```

mod common;

use std::path::{Path, PathBuf};
use std::process::Command;

use common::{assert_success, folder, run};

/// An interpreter with a package; says where none was found, and fails where one was promised.
fn python(package: &str) -> Option<PathBuf> {
    let has = |python: &Path| {
        let probe = Command::new(python)
            .args(["-c", &format!("import {package}")])
            .output();
        probe.is_ok_and(|probe| probe.status.success())
    };
    if let Some(named) = std::env::var_os("IMU_STAND_PYTHON").map(PathBuf::from) {
        assert!(
            has(&named),
            "IMU_STAND_PYTHON, {}, has no {package}",
            named.display()
        );
        return Some(named);
    }
    let workspace = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let own = workspace.join("target/python/bin/python");
    let found = [own, PathBuf::from("python3")].into_iter().find(|p| has(p));
    if found.is_none() {
        eprintln!(
            "NOT RUN: no python with {package}; see the head of crates/cli/tests/consumers.rs"
        );
    }
    found
}

/// Runs a program with these arguments; it asserts what has to hold.
fn holds(python: &Path, program: &str, arguments: &[&Path]) {
    let out = Command::new(python)
        .arg("-c")
        .arg(program)
        .args(arguments)
        .output()
        .expect("it starts");
    assert_success(&out);
}

/// A capture of a minute, and its export under a name.
fn exported(test: &str, names: &[&str]) -> Vec<PathBuf> {
    let folder = folder(test);
    let capture = folder.join("run.csv");
    let text = |path: &Path| path.display().to_string();
    let make = [
        "simulate",
        "--seconds",
        "60",
        "--seed",
        "3",
        "--out",
        &text(&capture),
    ];
    assert_success(&run(&make));
    let export = |name: &&str| {
        let out = folder.join(name);
        assert_success(&run(&["export", &text(&capture), "--out", &text(&out)]));
        out
    };
    std::iter::once(capture.clone())
        .chain(names.iter().map(export))
        .collect()
}

#[test]
fn pyyaml_reads_the_keys_of_kalibr_as_numbers() {
    let Some(python) = python("yaml") else { return };
    let files = exported("consumers_yaml", &["imu.yaml"]);
    let program = "
import sys, yaml
imu = yaml.safe_load(open(sys.argv[1]))
for key in ('gyroscope_noise_density', 'gyroscope_random_walk', 'update_rate'):
    assert isinstance(imu[key], (int, float)) and imu[key] > 0, (key, imu[key])
assert imu['rostopic'] == '/imu0' and imu['update_rate'] == 20, imu
";
    holds(&python, program, &[&files[1]]);
}

/// YAML 1.1 takes a number whose exponent has no sign for a text.
#[test]
fn pyyaml_reads_large_densities_as_numbers_too() {
    let Some(python) = python("yaml") else { return };
    let folder = folder("consumers_large");
    let (model, out) = (folder.join("m.toml"), folder.join("vins.yaml"));
    let toml = "format = \"imu-stand-model/1\"\nstand = \"large\"\nrate_hz = 20\n\n[[channel]]\nname = \"gyro_x\"\nunit = \"deg/s\"\n\
        angle_random_walk = { value = 90000, unit = \"deg/sqrt(h)\" }\nrate_random_walk = { value = 700, unit = \"deg/s/sqrt(s)\" }\n";
    std::fs::write(&model, toml).expect("room");
    let text = |path: &Path| path.display().to_string();
    for to in ["vins", "kalibr"] {
        let words = [
            "export",
            &text(&model),
            "--to",
            to,
            "--at-rate",
            "200",
            "--out",
            &text(&out),
        ];
        assert_success(&run(&words));
        let program = "
import sys, yaml
numbers = {k: v for k, v in yaml.safe_load(open(sys.argv[1])).items() if not str(v).startswith('/')}
assert all(isinstance(v, (int, float)) for v in numbers.values()), numbers
assert max(numbers.values()) > 1, numbers
";
        holds(&python, program, &[&out]);
    }
}

#[test]
fn an_xml_parser_reads_the_noise_of_each_axis_from_sdf() {
    let Some(python) = python("xml.etree.ElementTree") else {
        return;
    };
    let files = exported("consumers_sdf", &["imu.sdf"]);
    let program = "
import sys, xml.etree.ElementTree as tree
sensor = tree.parse(sys.argv[1]).getroot()
assert sensor.tag == 'sensor' and sensor.get('type') == 'imu'
for axis in 'xyz':
    noise = sensor.find(f'imu/angular_velocity/{axis}/noise')
    assert noise.get('type') == 'gaussian' and float(noise.find('stddev').text) > 0
";
    holds(&python, program, &[&files[1]]);
}

#[test]
fn numpy_runs_the_dictionary_of_gnss_ins_sim_and_loads_the_data() {
    let Some(python) = python("numpy") else {
        return;
    };
    let files = exported("consumers_numpy", &["imu.py", "run.npz"]);
    let program = "
import sys, numpy, runpy
err = runpy.run_path(sys.argv[1])['imu_err']
for key in ('gyro_b', 'gyro_arw', 'gyro_b_stability', 'gyro_b_corr', 'accel_vrw'):
    assert err[key].shape == (3,) and err[key].dtype == float, key
assert (err['gyro_arw'] > 1).all()
run = numpy.load(sys.argv[2])
assert run['gyro_x'].shape == run['time_s'].shape == (1200,)
assert run['seq'].dtype == numpy.int64 and abs(run['time_s'][20] - 1) < 1e-9
";
    holds(&python, program, &[&files[1], &files[2]]);
}

#[test]
fn pyarrow_reads_the_parquet_file_with_its_units() {
    let Some(python) = python("pyarrow.parquet") else {
        return;
    };
    let files = exported("consumers_arrow", &["run.parquet", "run2.csv"]);
    let program = "
import sys, pyarrow.parquet
table = pyarrow.parquet.read_table(sys.argv[1])
assert table.schema.metadata[b'unit of gyro_x'] == b'deg/s', table.schema.metadata
assert table.num_rows == 1200 and str(table.schema.field('gyro_x').type) == 'double'
rows = [line for line in open(sys.argv[2]) if not line.startswith('#')]
names, cells = rows[0].strip().split(','), rows[8].strip().split(',')
for name in ('time_s', 'gyro_x', 'gyro_z'):
    assert table[name][7].as_py() == float(cells[names.index(name)]), name
";
    holds(&python, program, &[&files[1], &files[2]]);
}
