//! Names that say what a column is, mappings of a part, and channels of any unit.

use super::*;

#[test]
fn names_that_say_what_they_are_and_in_which_unit_need_no_mapping() {
    for head in [
        // EuRoC; phyphox; rostopic echo -p; PX4's ulog2csv.
        "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1]\n",
        "Time (s),Gyroscope x (rad/s),Gyroscope y (rad/s)\n",
        "%time,field.angular_velocity.x,field.angular_velocity.y\n",
        "timestamp,gyro_rad[0],gyro_rad[1]\n",
    ] {
        let per_s = match head {
            _ if head.starts_with("#time") || head.starts_with("%time") => 1e9,
            _ if head.starts_with("timestamp") => 1e6,
            _ => 1.0,
        };
        let text = table(head, ",", ".", per_s, RAD);
        let read = read(text.as_bytes(), "", "").expect(head);
        is_the_table(&read);
        let notes = read.record.notes.join("; ");
        assert!(
            notes.contains("taken as their names say: ") && notes.contains("gyro in rad/s"),
            "{notes}"
        );
    }
    // What is not read of it is said.
    let text = "stamp [ns],gx_dps,Q\n0,0.1,25\n50000000,0.2,25\n100000000,0.1,25\n";
    let notes = read(text.as_bytes(), "", "").expect("a table");
    let notes = notes.record.notes.join("; ");
    assert!(notes.contains("not read: `Q`"), "{notes}");
    // A unit given goes before a convention, and one that nobody says is asked for.
    let text = table("t (s),gx,gy\n", ",", ".", 1.0, 1.0);
    is_the_table(&read(text.as_bytes(), "", "gyro=deg/s").expect("the unit is said"));
    let said = error(text.as_bytes(), "", "");
    assert!(
        said.contains("--columns 'time=t (s),gyro_x=gx,gyro_y=gy'"),
        "{said}"
    );
    // A logger for phones has x, y, z in the file of each sensor: they may be an accelerometer's.
    let bare = table("seconds_elapsed,x,y\n", ",", ".", 1.0, RAD);
    let said = error(bare.as_bytes(), "", "");
    assert!(
        said.contains("--units gyro=UNIT") && said.contains("of an accelerometer write acc_x"),
        "{said}"
    );
    let of_gyro = "time=seconds_elapsed,gyro_x=x,gyro_y=y";
    is_the_table(&read(bare.as_bytes(), of_gyro, "").expect("a phone's gyro"));
    // Two that could be one are a choice.
    let two = "Time (s),imu0.gyro.x (rad/s),imu1.gyro.x (rad/s)\n0,1,2\n1,1,2\n";
    let said = error(two.as_bytes(), "", "");
    assert!(said.contains("gyro_x=imu0.gyro.x (rad/s)"), "{said}");
    // The mapping of a name that says its unit has that unit.
    let ros = table(
        "t,angular_velocity.x,angular_velocity.y\n",
        ",",
        ".",
        1.0,
        RAD,
    );
    let map = "time=t,gyro_x=angular_velocity.x,gyro_y=angular_velocity.y";
    is_the_table(&read(ros.as_bytes(), map, "").expect("rad/s"));
}

#[test]
fn a_mapping_of_what_stands_beside_leaves_the_gyros_that_have_our_names() {
    let text = table("stamp,gyro_x,gyro_y\n", ",", ".", 1e3, 1.0);
    for columns in ["time=stamp", "t=stamp"] {
        let read = read(text.as_bytes(), columns, "time=ms,gyro=deg/s").expect(columns);
        is_the_table(&read);
    }
    let text = "time,time_s,gyro_x,Die\n0,9,1,300\n20,8,2,301\n40,7,3,302\n";
    let both = read(
        text.as_bytes(),
        "time=time,temp=Die",
        "time=ms,gyro=deg/s,temp=K",
    )
    .expect("four columns");
    let times = both.record.host_time_s.as_ref().expect("times");
    assert!((times[2] - 0.04).abs() < 1e-12, "{times:?}");
    assert!((both.record.channel("temp").expect("temp").values[0] - 26.85).abs() < 1e-9);
    // Who maps a gyro chooses.
    let text = "time,gyro_x,gx\n0,1,5\n0.02,2,6\n";
    let chosen = read(text.as_bytes(), "time=time,gyro_x=gx", "gyro=deg/s").expect("one gyro");
    assert_eq!(chosen.record.channels.len(), 1);
    assert_eq!(chosen.record.channels[0].values, [5.0, 6.0]);
}

#[test]
fn one_thermometer_is_that_of_all_gyros_and_any_column_of_any_unit_is_a_channel() {
    let text = "t,gx,gy,die\n0,1,2,20\n0.02,2,3,21\n";
    let map = "time=t,gyro_x=gx,gyro_y=gy,temp_x=die";
    let shared = read(text.as_bytes(), map, "gyro=deg/s,temp=degC")
        .expect("two gyros")
        .record;
    let temp = shared.channel("temp").expect("temp");
    assert_eq!((temp.axis, temp.values[1]), (None, 21.0));
    assert!(
        shared
            .notes
            .iter()
            .any(|n| n.contains("temp_x is the only thermometer")),
        "{:?}",
        shared.notes
    );
    // Of one gyro it is that gyro's.
    let own = read(
        text.as_bytes(),
        "time=t,gyro_x=gx,temp_x=die",
        "gyro=deg/s,temp=degC",
    )
    .expect("one gyro");
    assert!(own.record.channel("temp_x").is_some());
    let clock = read(text.as_bytes(), "time=t,freq=gx", "freq=1")
        .expect("an oscillator")
        .record;
    let freq = clock.channel("freq").expect("freq");
    assert_eq!((freq.unit.as_str(), freq.values[1]), ("1", 2.0));
    assert!(clock.notes.is_empty(), "{:?}", clock.notes);
}

#[test]
fn a_second_time_that_is_not_read_and_the_unit_of_a_name_are_told() {
    let text = "host_time_s,time_s,gyro_x\n100,0,1\n100.03,0.02,2\n100.04,0.04,3\n";
    let arrival = read(text.as_bytes(), "", "gyro=deg/s")
        .expect("two times")
        .record;
    let notes = arrival.notes.join("; ");
    assert_eq!(
        arrival.host_time_s.as_ref().map(|t| t[1] > 100.02),
        Some(true)
    );
    assert!(
        notes.contains("those of `host_time_s`, and `time_s` is not read: `--columns time=time_s`"),
        "{notes}"
    );
    let asked = read(text.as_bytes(), "time=time_s", "gyro=deg/s")
        .expect("one of two")
        .record;
    let notes = asked.notes.join("; ");
    assert!(
        notes.contains("`host_time_s` is not read: `--columns` names another"),
        "{notes}"
    );
    assert!((asked.host_time_s.expect("times")[1] - 0.02).abs() < 1e-12);

    let text = "time_s,gyro_x_dps,temp_F\n0,1,68\n0.02,2,86\n0.04,3,86\n";
    let fahrenheit = read(text.as_bytes(), "", "")
        .expect("all names say it")
        .record;
    assert!((fahrenheit.channel("temp").expect("temp").values[1] - 30.0).abs() < 1e-9);
    let notes = fahrenheit.notes.join("; ");
    assert!(notes.contains("gyro in deg/s, temp in degF"), "{notes}");
}

#[test]
fn nothing_is_mapped_beside_the_columns_of_a_capture() {
    let own = "# format: imu-stand-capture/1\n# gyro_lsb_dps: 0.07\n# temp_lsb_c: 0.1\n# temp_zero_c: 25\nseq,gyro_x,temp_x\n0,1,9\n1,2,9\n";
    let said = error(own.as_bytes(), "temp=temp_x", "");
    assert!(
        said.contains("--columns: the file is a capture") && said.contains("leave it out"),
        "{said}"
    );
    // Who maps a gyro chooses, as before.
    let chosen = read(own.as_bytes(), "gyro_x=gyro_x", "gyro=deg/s")
        .expect("a gyro")
        .record;
    assert_eq!(chosen.channels[0].values, [1.0, 2.0]);
}

#[test]
fn where_a_column_is_not_there_the_proposal_is_of_what_was_asked() {
    let text = "t,gx,gy,gz,ax,ay,az\n0,1,2,3,0,0,1\n0.1,2,1,3,0,0,1\n0.2,1,2,2,0,0,1\n";
    let proposal = |columns: &str, units: &str| {
        let said = error(text.as_bytes(), columns, units);
        assert!(said.contains("there is no column `nix`"), "{said}");
        let (_, line) = said.split_once("--columns ").expect("a proposal");
        line.to_owned()
    };
    assert_eq!(
        proposal("gyro_x=nix", ""),
        "time=t,gyro_x=gx --units gyro=UNIT"
    );
    assert_eq!(
        proposal("acc_z=nix,time=t,acc_x=ax", "acc=g"),
        "acc_z=az,time=t,acc_x=ax --units acc=g"
    );
    // What is in the file for something else is not given twice, and what nothing is like is left to the reader.
    assert_eq!(
        proposal("gyro_x=nix,gyro_y=gx,supply=nix", "gyro=deg/s"),
        "time=t,gyro_x=COLUMN,gyro_y=gx,supply=COLUMN --units gyro=deg/s"
    );
    // The columns of a capture need no mapping.
    let capture = "# format: imu-stand-capture/1\n# rate_hz: 20\n# gyro_lsb_dps: 0.07326\ngyro_x,gyro_y\n1,2\n2,3\n";
    let said = error(capture.as_bytes(), "gyro_x=nix", "");
    assert!(
        said.contains("the columns are: gyro_x, gyro_y") && said.contains("leave it out"),
        "{said}"
    );
}

#[test]
fn foreign_gyros_beside_names_of_ours_get_a_proposal_that_works() {
    for (names, beside) in [
        ("temp", "temp"),
        ("temp_x", "temp"),
        ("supply", ""),
        ("acc_x,acc_y,acc_z", "acc_z"),
    ] {
        let rest = ",1.5".repeat(names.split(',').count());
        let mut text = format!("time,gx,gy,gz,{names}\n");
        for k in 0..20 {
            text += &format!("{},0.{k},0.{},0.25{rest}\n", 0.05 * f64::from(k), k + 1);
        }
        let said = error(text.as_bytes(), "", "");
        // Of a file of others no key is missing.
        assert!(!said.contains("lacks the key"), "{said}");
        let (_, line) = said.split_once("--columns ").expect("a proposal");
        let (columns, units) = line.split_once(" --units ").expect("units");
        assert!(columns.starts_with("time=time,gyro_x=gx,"), "{line}");
        let units = units
            .replace("gyro=UNIT", "gyro=deg/s")
            .replace("acc=UNIT", "acc=g")
            .replace("temp=UNIT", "temp=degC");
        let read = read(text.as_bytes(), columns, &units).expect(line).record;
        assert!((read.channel("gyro_y").expect("a gyro").values[3] - 0.4).abs() < 1e-12);
        if !beside.is_empty() {
            assert!(read.channel(beside).is_some(), "{line}");
        }
    }
}
