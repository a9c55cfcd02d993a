use super::say::proposal;
use super::*;

#[test]
fn another_spelling_of_a_name_of_ours_is_taken_for_it() {
    for (name, ours) in [
        ("temperature", "temp"),
        ("Temperature_y", "temp_y"),
        ("gyrox", "gyro_x"),
        ("GyroZ", "gyro_z"),
        ("gyroscope_y", "gyro_y"),
        ("accel_z", "acc_z"),
        ("t", "time"),
        ("Supply_Voltage", "supply"),
    ] {
        assert_eq!(alias(name).as_deref(), Some(ours), "{name}");
    }
    for name in [
        "temp",
        "gyro_x",
        "gyro",
        "gyro_temp",
        "ocxo",
        "x",
        "voltage",
    ] {
        assert_eq!(alias(name), None, "{name}");
    }
}

#[test]
fn a_name_that_misses_ours_by_little_is_told_and_others_are_left_alone() {
    for (name, ours) in [
        ("temperature", "temp"),
        ("temperature_y", "temp_y"),
        ("gyrox", "gyro_x"),
        ("gyroscope_z", "gyro_z"),
        ("accx", "acc_x"),
        ("accel_z", "acc_z"),
        ("timestamp", "time"),
        ("supply_voltage", "supply"),
        ("motor", "pwm"),
    ] {
        assert_eq!(nearest(name).as_deref(), Some(ours), "{name}");
    }
    for name in ["ocxo", "laser", "x", "pressure"] {
        assert_eq!(nearest(name), None, "{name}");
    }
}

#[test]
fn a_proposal_maps_each_axis_to_its_own_column_with_the_headers_units_and_quotes() {
    let cases = [
        (
            "Time (s);Gyroscope x (rad/s);Gyroscope y (rad/s);Gyroscope z (rad/s)",
            "--columns 'time=Time (s),gyro_x=Gyroscope x (rad/s),gyro_y=Gyroscope y (rad/s),gyro_z=Gyroscope z (rad/s)' \
             --units gyro=rad/s",
        ),
        (
            "Timestamp (us);Gyroscope X (deg/s);Gyroscope Y (deg/s);Gyroscope Z (deg/s);Accelerometer X (g)",
            "--columns 'time=Timestamp (us),gyro_x=Gyroscope X (deg/s),gyro_y=Gyroscope Y (deg/s),gyro_z=Gyroscope Z (deg/s),\
             acc_x=Accelerometer X (g)' --units time=us,gyro=deg/s,acc=g",
        ),
        (
            "timestamp [ns];w_RS_S_x [rad s^-1];w_RS_S_y [rad s^-1];w_RS_S_z [rad s^-1];a_RS_S_z [m s^-2]",
            "--columns 'time=timestamp [ns],gyro_x=w_RS_S_x [rad s^-1],gyro_y=w_RS_S_y [rad s^-1],\
             gyro_z=w_RS_S_z [rad s^-1],acc_z=a_RS_S_z [m s^-2]' --units time=ns,gyro=rad/s,acc=m/s2",
        ),
        (
            "time_s;gx_dps;gy_dps;gz_dps;ax_mps2;temp_c",
            "--columns time=time_s,gyro_x=gx_dps,gyro_y=gy_dps,gyro_z=gz_dps,acc_x=ax_mps2,temp=temp_c --units \
             gyro=deg/s,acc=m/s2",
        ),
        (
            "time;seconds_elapsed;z;y;x",
            "--columns time=seconds_elapsed,gyro_x=x,gyro_y=y,gyro_z=z --units gyro=UNIT",
        ),
        (
            "t;GyroX;GyroY;GyroZ;AccX;MagX",
            "--columns time=t,gyro_x=GyroX,gyro_y=GyroY,gyro_z=GyroZ,acc_x=AccX --units gyro=UNIT,acc=UNIT",
        ),
        (
            "gyr[0];gyr[1];gyr[2];mag[0]",
            "--columns 'gyro_x=gyr[0],gyro_y=gyr[1],gyro_z=gyr[2]' --units gyro=UNIT",
        ),
        (
            "Zeit (s);Drehrate x (°/s);Drehrate y (°/s)",
            "--columns 'time=Zeit (s),gyro_x=Drehrate x (°/s),gyro_y=Drehrate y (°/s)' --units gyro=deg/s",
        ),
        (
            "imu0.time;imu0.gx;imu0.gyro.y;imu0.ax",
            "--columns time=imu0.time,gyro_x=imu0.gx,gyro_y=imu0.gyro.y,acc_x=imu0.ax --units gyro=UNIT,acc=UNIT",
        ),
        (
            "micros;gx;gy",
            "--columns time=micros,gyro_x=gx,gyro_y=gy --units time=us,gyro=UNIT",
        ),
        ("Zeit;gx", "--columns time=Zeit,gyro_x=gx --units gyro=UNIT"),
        (
            "t;xgyro;ygyro;zgyro;xacc",
            "--columns time=t,gyro_x=xgyro,gyro_y=ygyro,gyro_z=zgyro,acc_x=xacc --units gyro=UNIT,acc=UNIT",
        ),
        (
            "omega1;omega2;omega3",
            "--columns gyro_x=omega1,gyro_y=omega2,gyro_z=omega3 --units gyro=UNIT",
        ),
        (
            "t;roll;rollrate;pitch_rate;yawRate",
            "--columns time=t,gyro_x=rollrate,gyro_y=pitch_rate,gyro_z=yawRate --units gyro=UNIT",
        ),
        (
            "r;q;p;throttle",
            "--columns gyro_x=p,gyro_y=q,gyro_z=r --units gyro=UNIT",
        ),
        (
            "t;rot_x;rot_y",
            "--columns time=t,gyro_x=rot_x,gyro_y=rot_y --units gyro=UNIT",
        ),
        (
            "t;acc;Gyro's rate",
            r"--columns 'time=t,gyro_x=Gyro'\''s rate' --units gyro=UNIT",
        ),
        ("y", "--columns gyro_y=y --units gyro=UNIT"),
        ("values", "--columns gyro_x=values --units gyro=UNIT"),
    ];
    are_proposed(&cases);
    let numbered = |n: usize| proposal(&vec![String::new(); n], true, true, &Seen::default()).line;
    assert_eq!(numbered(1), "--columns gyro_x=1 --units gyro=UNIT");
    assert_eq!(
        numbered(3),
        "--columns gyro_x=1,gyro_y=2,gyro_z=3 --units gyro=UNIT"
    );
    assert_eq!(
        numbered(7),
        "--columns time=1,gyro_x=2,gyro_y=3,gyro_z=4,acc_x=5,acc_y=6,acc_z=7 --units gyro=UNIT,acc=UNIT"
    );
}

/// Eight rows and more of columns: a time by its step, a count, or noise about a middle.
fn seen(columns: &[Of]) -> (Vec<String>, Seen) {
    let row = |k: usize, of: &Of| match of {
        Of::Time(step) => 3.0 + step * k as f64,
        Of::Noise(middle) => middle + 0.1 * ((k * 7 % 11) as f64 / 5.0 - 1.0),
    };
    let column = |of: &Of| (0..50).map(|k| row(k, of)).collect();
    let names = (1..=columns.len()).map(|k| format!("column_{k}")).collect();
    (names, Seen(columns.iter().map(column).collect()))
}

enum Of {
    Time(f64),
    Noise(f64),
}

#[test]
fn a_table_without_names_is_proposed_by_what_its_values_are() {
    use Of::{Noise, Time};
    let still = || [Noise(0.0), Noise(-0.2), Noise(0.3)];
    let down = |g: f64| [Noise(0.01 * g), Noise(0.1 * g), Noise(g)];
    let flat = |parts: Vec<Vec<Of>>| parts.into_iter().flatten().collect::<Vec<Of>>();
    let cases = [
        // An even time is none of three gyros.
        (
            vec![Time(0.05), Noise(0.0), Noise(1.0)],
            "--columns time=1,gyro_x=2,gyro_y=3 --units gyro=UNIT",
        ),
        (
            Vec::from(still()),
            "--columns gyro_x=1,gyro_y=2,gyro_z=3 --units gyro=UNIT",
        ),
        // What numbers the rows is no time, and the rate is asked for.
        (
            vec![Time(1.0), Noise(0.0)],
            "--columns gyro_x=2 --units gyro=UNIT --rate HZ",
        ),
        (
            flat(vec![vec![Time(1.0), Time(0.01)], still().into()]),
            "--columns time=2,gyro_x=3,gyro_y=4,gyro_z=5 --units gyro=UNIT",
        ),
        // Gravity tells the accelerometers, and their unit.
        (
            flat(vec![vec![Time(0.01)], down(9.81).into(), still().into()]),
            "--columns time=1,gyro_x=5,gyro_y=6,gyro_z=7,acc_x=2,acc_y=3,acc_z=4 --units gyro=UNIT,acc=m/s2",
        ),
        (
            flat(vec![still().into(), down(1000.0).into()]),
            "--columns gyro_x=1,gyro_y=2,gyro_z=3,acc_x=4,acc_y=5,acc_z=6 --units gyro=UNIT,acc=mg",
        ),
        // A thermometer between; counts, of which none is gravity; a magnetometer beside.
        (
            flat(vec![
                vec![Time(0.01)],
                down(9.81).into(),
                vec![Noise(25.0)],
                still().into(),
            ]),
            "--columns time=1,gyro_x=COLUMN,gyro_y=COLUMN,gyro_z=COLUMN,acc_x=2,acc_y=3,acc_z=4 --units gyro=UNIT,acc=m/s2",
        ),
        (
            flat(vec![down(16384.0).into(), still().into()]),
            "--columns gyro_x=COLUMN,gyro_y=COLUMN,gyro_z=COLUMN,acc_x=COLUMN,acc_y=COLUMN,acc_z=COLUMN --units \
             gyro=UNIT,acc=UNIT",
        ),
        (
            flat(vec![down(300.0).into(), down(9.81).into(), still().into()]),
            "--columns gyro_x=COLUMN,gyro_y=COLUMN,gyro_z=COLUMN,acc_x=4,acc_y=5,acc_z=6 --units gyro=UNIT,acc=m/s2",
        ),
    ];
    for (columns, expected) in cases {
        let (names, seen) = seen(&columns);
        let knows_rate = !expected.contains("--rate");
        assert_eq!(proposal(&names, true, knows_rate, &seen).line, expected);
    }
}

#[test]
fn columns_of_one_array_go_by_their_places_and_values_too() {
    let (_, values) = seen(&[
        Of::Time(0.01),
        Of::Noise(0.0),
        Of::Noise(0.2),
        Of::Noise(0.0),
    ]);
    let names: Vec<String> = (0..4).map(|k| format!("values[{k}]")).collect();
    let proposed = proposal(&names, false, false, &values);
    let expected = "--columns 'time=values[0],gyro_x=values[1],gyro_y=values[2],gyro_z=values[3]' --units gyro=UNIT";
    assert_eq!(
        (proposed.line.as_str(), proposed.open),
        (expected, vec!["gyro"])
    );
}

#[test]
fn values_tell_a_time_whose_name_does_not_and_what_is_no_rate() {
    let names = ["n", "k", "b"].map(str::to_owned);
    let (_, values) = seen(&[Of::Noise(0.0), Of::Time(0.05), Of::Noise(1.0)]);
    assert_eq!(
        proposal(&names, false, false, &values).line,
        "--columns time=k,gyro_x=n --units gyro=UNIT"
    );
    let (_, Seen(mut columns)) = seen(&[Of::Time(0.5), Of::Noise(0.0)]);
    columns[1].iter_mut().for_each(|v| *v *= 1e-10);
    let names = ["time_s", "y"].map(str::to_owned);
    assert_eq!(
        proposal(&names, false, false, &Seen(columns)).line,
        "--columns time=time_s,freq=y --units freq=1"
    );
}

#[test]
fn gravity_tells_the_accelerometer_where_axes_have_no_other_name() {
    let (_, values) = seen(&[
        Of::Time(0.05),
        Of::Noise(9.8),
        Of::Noise(0.1),
        Of::Noise(0.3),
    ]);
    let names = ["seconds_elapsed", "z", "y", "x"].map(str::to_owned);
    assert_eq!(
        proposal(&names, false, false, &values).line,
        "--columns time=seconds_elapsed,acc_x=x,acc_y=y,acc_z=z --units acc=m/s2"
    );
}

/// Lists of names, and what is proposed of them.
fn are_proposed(cases: &[(&str, &str)]) {
    for (names, expected) in cases {
        let names: Vec<String> = names.split(';').map(str::to_owned).collect();
        let proposed = proposal(&names, false, true, &Seen::default());
        assert_eq!(proposed.line, *expected);
        assert_eq!(
            !proposed.open.is_empty(),
            expected.contains("=UNIT"),
            "{names:?}"
        );
    }
}

#[test]
fn the_axes_of_one_sensor_are_proposed_and_angles_leave_their_unit_open() {
    are_proposed(&[
        // An angle may be a rate whose unit was written short.
        (
            "time_s;roll_deg;pitch_deg;yaw_deg",
            "--columns time=time_s,gyro_x=roll_deg,gyro_y=pitch_deg,gyro_z=yaw_deg --units gyro=UNIT",
        ),
        (
            "time_s;Euler_X (deg);Euler_Y (deg);Euler_Z (deg)",
            "--columns 'time=time_s,gyro_x=Euler_X (deg),gyro_y=Euler_Y (deg),gyro_z=Euler_Z (deg)' --units gyro=UNIT",
        ),
        // The axes of one sensor, not the first of each.
        (
            "t;b.gyro_y;b.gyro_z;a.gyro_x;a.gyro_y;b.gyro_x;a.gyro_z",
            "--columns time=t,gyro_x=b.gyro_x,gyro_y=b.gyro_y,gyro_z=b.gyro_z --units gyro=UNIT",
        ),
        (
            "t;gx1;gy1;gz1;gx2;gy2;gz2",
            "--columns time=t,gyro_x=gx1,gyro_y=gy1,gyro_z=gz1 --units gyro=UNIT",
        ),
    ]);
}

#[test]
fn a_second_imu_is_told_with_its_columns() {
    let names = "t;imu0.gx;imu0.gy;imu0.gz;imu0.ax;imu0.ay;imu0.az;imu1.gx;imu1.gy;imu1.gz;imu1.ax;imu1.ay;imu1.az";
    let names: Vec<String> = names.split(';').map(str::to_owned).collect();
    let proposed = proposal(&names, false, false, &Seen::default());
    let hint = proposed.hints.join("; ");
    assert!(proposed.line.contains("gyro_x=imu0.gx") && !proposed.line.contains("imu1"));
    let second =
        "gyro_x=imu1.gx,gyro_y=imu1.gy,gyro_z=imu1.gz,acc_x=imu1.ax,acc_y=imu1.ay,acc_z=imu1.az";
    assert!(
        hint.contains("a second gyro") && hint.contains(second),
        "{hint}"
    );
    let hints = proposal(&names[..7], false, false, &Seen::default()).hints;
    assert!(hints.is_empty(), "{hints:?}");
}

#[test]
fn whole_numbers_beside_counts_are_no_unit_that_nobody_says() {
    let whole = |middle: f64| (0..50).map(|k| middle + f64::from(k * 7 % 5)).collect();
    let names = ["gx", "gy", "gz", "ax", "ay", "az", "temp"].map(str::to_owned);
    let seen = Seen(
        [40.0, -70.0, 20.0, 9.0, -21.0, 1020.0, 253.0]
            .map(whole)
            .into(),
    );
    // 1024 counts a g are near 1000 mg, and 253 counts may be 25.3 degC.
    let proposed = proposal(&names, false, true, &seen);
    assert!(
        proposed
            .line
            .ends_with("--units gyro=UNIT,acc=UNIT,temp=UNIT"),
        "{}",
        proposed.line
    );
}
