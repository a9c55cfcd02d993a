//! Measured records, analyzed and diagnosed by the program.

use super::*;

/// Measured records: `IMU_STAND_DATA` names their folder.
fn measured(file: &str) -> Option<PathBuf> {
    match std::env::var_os("IMU_STAND_DATA") {
        Some(folder) => Some(Path::new(&folder).join(file)),
        None => {
            println!("NOT RUN: {file} is looked for where IMU_STAND_DATA points, and it is unset");
            None
        }
    }
}

#[test]
fn measured_records_are_analyzed_and_diagnosed_by_column_mapping() {
    let axes =
        "gyro_x=gx_dps,gyro_y=gy_dps,gyro_z=gz_dps,acc_x=ax_mps2,acc_y=ay_mps2,acc_z=az_mps2";
    for (file, more) in [
        ("adis16405_run1_20hz_600s.csv.gz", ""),
        ("mpu6050_static_20hz_600s.csv.gz", ",temp=temp_c"),
    ] {
        let Some(path) = measured(file) else { return };
        let folder = folder(file);
        let columns = format!("time=time_s,{axes}{more}");
        let units = "gyro=deg/s,acc=m/s2,temp=degC";
        let out = folder.join("out.json");
        for (command, format) in [
            ("analyze", "imu-stand-analysis/1"),
            ("diagnose", "imu-stand-diagnosis/1"),
        ] {
            let made = run(&[
                command,
                path.to_str().unwrap(),
                "--columns",
                &columns,
                "--units",
                units,
                "--json",
                out.to_str().unwrap(),
            ]);
            assert_success(&made);
            assert_eq!(json(&out)["format"], format);
        }
        // Static records at constant temperature, far from any motor: nothing of the stand's own may be blamed.
        for finding in json(&out)["findings"].as_array().unwrap() {
            let cause = finding["cause"].as_str().unwrap();
            assert!(
                ![
                    "motor_bias",
                    "motor_noise",
                    "supply_sensitivity",
                    "base_motion"
                ]
                .contains(&cause),
                "{cause}"
            );
        }
    }
}
