//! Sensors and actuators by their interfaces.

use crate::{house, member, start};
use rcis_generated::testing::PoseTopicsSample;
use rcis_generated::types::robo_comp_joint_motor as motor;
use rcis_generated::{
    Bases, BatteryStates, Bumpers, Cameras, Imus, Lasers, Lidars, MotorGoalPosition,
    MotorGoalVelocity, Motors, OmniBases, Poses, RgbdCameras, Rgbds, SimpleCameras, TouchSensors,
    Ultrasounds, Worker, WorkerError, interfaces,
};
use std::f32::consts::{FRAC_PI_2, TAU};
use std::time::Duration;

#[test]
fn a_laser_counts_from_right_to_left() -> Result<(), WorkerError> {
    let (mut worker, mut test) = house();
    let front = member(test.lasers.get("front"));
    let scan = worker.get_laser_data(&mut test, &front);
    assert_eq!(scan.len(), 181);
    assert!((scan[0].angle + FRAC_PI_2).abs() < 1e-6 && (scan[180].angle - FRAC_PI_2).abs() < 1e-6);
    // The robot looks north: the east wall is to its right, the middle wall to its left.
    assert!((scan[0].dist - 2950.0).abs() < 60.0, "{:?}", scan[0]);
    assert!((scan[180].dist - 1950.0).abs() < 60.0, "{:?}", scan[180]);
    let conf = worker.get_laser_conf_data(&mut test, &front);
    assert_eq!(
        (conf.max_measures, conf.max_degrees, conf.sample_rate),
        (181, 180, 50)
    );
    let (again, state) = worker.get_laser_and_b_state_data(&mut test, &front);
    assert_eq!(again, scan);
    assert_eq!((state.x, state.z), (2000.0, -1500.0));
    assert!((state.alpha - FRAC_PI_2).abs() < 1e-6);
    Ok(())
}

#[test]
fn a_base_drives_and_tells_its_true_pose() -> Result<(), WorkerError> {
    let (mut worker, mut test) = house();
    let base = member(test.bases.get("base"));
    Bases::set_speed_base(&mut worker, &mut test, &base, 400.0, 0.5);
    test.run(&mut worker, Duration::from_secs(1))?;
    let poses: Vec<_> = test.pose_topics.member("base").samples();
    assert_eq!(poses.len(), 21);
    let PoseTopicsSample::NewFullPose { pose } = poses.last().expect("a pose");
    // An arc of 800 mm to the left, from (2000, −1500) northwards.
    let (x, y) = (
        2000.0 - 800.0 * (1.0 - 0.5_f32.cos()),
        -1500.0 + 800.0 * 0.5_f32.sin(),
    );
    assert!(
        (pose.x - x).abs() < 10.0 && (pose.y - y).abs() < 10.0,
        "{pose:?}"
    );
    assert!((pose.rz - FRAC_PI_2 - 0.5).abs() < 0.01 && pose.vrz == 0.5);
    let state = Bases::get_base_state(&mut worker, &mut test, &base).expect("a base");
    assert!(state.is_moving && (state.rot_v - 0.5).abs() < 1e-6);
    Bases::reset_odometer(&mut worker, &mut test, &base);
    assert_eq!(
        Bases::get_base_pose(&mut worker, &mut test, &base).expect("a base"),
        (0, 0, 0.0)
    );
    Bases::set_odometer_pose(&mut worker, &mut test, &base, 5, 6, 1.0);
    Bases::correct_odometer(&mut worker, &mut test, &base, 7, 8, 2.0);
    let state = Bases::get_base_state(&mut worker, &mut test, &base).expect("a base");
    assert_eq!(
        (state.x, state.z, state.corrected_x, state.corrected_alpha),
        (5.0, 6.0, 7.0, 2.0)
    );
    let limits = worker.get_mech_params(&mut test, &base);
    assert_eq!((limits.max_vel_adv, limits.max_vel_rot), (1000.0, 3.0));
    // Nonsense stops the base.
    Bases::set_speed_base(&mut worker, &mut test, &base, f32::NAN, 0.0);
    let state = Bases::get_base_state(&mut worker, &mut test, &base).expect("a base");
    assert!(!state.is_moving);
    Ok(())
}

#[test]
fn a_battery_a_bumper_and_a_sonar() -> Result<(), WorkerError> {
    let (mut worker, mut test) = house();
    let base = member(test.bases.get("base"));
    let battery = member(test.batteries.get("battery"));
    let state = rcis_generated::Batteries::get_battery_state(&mut worker, &mut test, &battery);
    assert_eq!(state.expect("a battery").state, BatteryStates::Charged);
    Bases::set_speed_base(&mut worker, &mut test, &base, -1000.0, 0.0);
    test.run(&mut worker, Duration::from_secs(3))?;
    let state = rcis_generated::Batteries::get_battery_state(&mut worker, &mut test, &battery);
    let state = state.expect("a battery");
    assert!(state.percentage < 100.0 && state.state == BatteryStates::Disconnected);
    // The south wall has stopped it.
    let bumpers = member(test.bumpers.get("base"));
    assert_eq!(
        Bumpers::get_sensor_data(&mut worker, &mut test, &bumpers)["bumper"].state,
        1
    );
    Bumpers::disable(&mut worker, &mut test, &bumpers);
    assert_eq!(
        Bumpers::get_sensor_data(&mut worker, &mut test, &bumpers)["bumper"].state,
        0
    );
    assert!(!Bumpers::is_enabled(&mut worker, &mut test, &bumpers));
    Bumpers::reset(&mut worker, &mut test, &bumpers);
    let touch = member(test.touch_sensors.get("base"));
    assert_eq!(worker.get_values(&mut test, &touch)["bumper"].value, 1.0);
    let sonars = member(test.ultrasounds.get("base"));
    assert_eq!(worker.get_sonars_number(&mut test, &sonars), 1);
    let range = worker.get_sensor_distance(&mut test, &sonars, "sonar".into());
    assert!(range.expect("a range") > 1000);
    assert_eq!(worker.get_all_sonar_pose(&mut test, &sonars)[0].y, 220.0);
    use interfaces::ultrasound::GetSensorDistanceError;
    let unknown = worker.get_sensor_distance(&mut test, &sonars, "imu".into());
    assert!(matches!(
        unknown,
        Err(GetSensorDistanceError::UnknownSensorException(_))
    ));
    Ok(())
}

#[test]
fn pictures_depths_and_points_are_of_one_moment() {
    let (mut worker, mut test) = house();
    let camera = member(test.rgbd_cameras.get("camera"));
    let all =
        RgbdCameras::get_all(&mut worker, &mut test, &camera, String::new()).expect("a frame");
    assert_eq!(
        (all.image.width, all.image.height, all.image.depth),
        (320, 240, 3)
    );
    assert_eq!(all.image.image.len(), 320 * 240 * 3);
    let depth = |at: usize| {
        let bytes = [0, 1, 2, 3].map(|n| all.depth.depth[at * 4 + n]);
        f32::from_le_bytes(bytes)
    };
    let points =
        RgbdCameras::get_points(&mut worker, &mut test, &camera, "camera".into()).expect("points");
    for at in [0, 31_999, 40_000, 76_799] {
        let point = &points.points[at];
        assert_eq!(point.z, depth(at));
        let (u, v) = (
            160.0 + 280.0 * point.x / point.z,
            120.0 - 280.0 * point.y / point.z,
        );
        assert!(
            (u - (at % 320) as f32 - 0.5).abs() < 0.01
                && (v - (at / 320) as f32 - 0.5).abs() < 0.01
        );
    }
    let other = RgbdCameras::get_depth(&mut worker, &mut test, &camera, "other".into());
    use interfaces::camera_rgbd_simple::GetDepthError;
    assert!(matches!(
        other,
        Err(GetDepthError::HardwareFailedException(_))
    ));
    let rgbd = member(test.rgbds.get("camera"));
    let (bytes, depths, motors, base) = worker.get_data(&mut test, &rgbd).expect("a frame");
    assert_eq!(bytes, all.image.image);
    assert_eq!(depths[40_000], depth(40_000));
    assert!(motors.contains_key("pan") && base.x == 2000.0);
    let params = worker.get_rgbd_params(&mut test, &rgbd);
    assert_eq!((params.color.focal, params.color.fps), (280, 15));
    let plain = member(test.cameras.get("camera"));
    let image = Cameras::get_image(&mut worker, &mut test, &plain);
    assert_eq!((image.number, image.data.len()), (1, 230_400));
    let simple = member(test.simple_cameras.get("camera"));
    let image = SimpleCameras::get_image(&mut worker, &mut test, &simple).expect("a picture");
    assert_eq!(image.image, bytes);
}

#[test]
fn motors_go_where_they_may() -> Result<(), WorkerError> {
    use interfaces::joint_motor::SetPositionError;
    let (mut worker, mut test) = house();
    let motors = member(test.motors.get("base"));
    let goal = |name: &str, position| MotorGoalPosition {
        name: name.to_owned(),
        position,
        max_speed: 0.0,
    };
    worker
        .set_position(&mut test, &motors, goal("pan", 1.0))
        .expect("a motor");
    test.run(&mut worker, Duration::from_millis(250))?;
    let state = worker
        .get_motor_state(&mut test, &motors, "pan".into())
        .expect("a motor");
    assert!((state.pos - 0.5).abs() < 0.03 && (state.vel - 2.0).abs() < 1e-3 && state.is_moving);
    let beyond = worker.set_position(&mut test, &motors, goal("pan", 2.0));
    assert!(matches!(
        beyond,
        Err(SetPositionError::HardwareFailedException(_))
    ));
    let unknown = worker.set_position(&mut test, &motors, goal("tilt", 0.0));
    assert!(matches!(
        unknown,
        Err(SetPositionError::UnknownMotorException(_))
    ));
    let nonsense = MotorGoalVelocity {
        name: "pan".to_owned(),
        velocity: f32::NAN,
        max_acc: 0.0,
    };
    assert!(worker.set_velocity(&mut test, &motors, nonsense).is_err());
    worker
        .set_sync_zero_pos(&mut test, &motors)
        .expect("motors");
    test.run(&mut worker, Duration::from_secs(1))?;
    let all = worker
        .get_all_motor_state(&mut test, &motors)
        .expect("motors");
    assert_eq!(all["pan"].pos, 0.0);
    let params: Vec<motor::MotorParams> = worker.get_all_motor_params(&mut test, &motors);
    assert_eq!((params[0].min_pos, params[0].max_velocity), (-1.5, 2.0));
    Ok(())
}

#[test]
fn the_speed_of_a_true_pose_is_that_of_the_body() -> Result<(), WorkerError> {
    let text = r#"<innerModel>
        <plane id="wall" pz="1050" size="4000,4000,100" collide="1"/>
        <differentialrobot id="base" slip="0.5" collide="1">
            <cylinder id="hull" radius="200" length="300" collide="1"/>
        </differentialrobot>
    </innerModel>"#;
    let (mut worker, mut test) = start(text);
    let base = member(test.bases.get("base"));
    let pose = member(test.poses.get("base"));
    Bases::set_speed_base(&mut worker, &mut test, &base, 400.0, 0.0);
    test.run(&mut worker, Duration::from_secs(1))?;
    let here = worker.get_full_pose_euler(&mut test, &pose);
    assert!((here.y - 200.0).abs() < 1e-2 && (here.vy - 200.0).abs() < 1e-2);
    let state = Bases::get_base_state(&mut worker, &mut test, &base).expect("a base");
    assert!(state.is_moving && (state.adv_vz - 400.0).abs() < 1e-2);
    // The wall stops it.
    test.run(&mut worker, Duration::from_secs(4))?;
    let state = Bases::get_base_state(&mut worker, &mut test, &base).expect("a base");
    assert!(!state.is_moving, "{state:?}");
    Ok(())
}

#[test]
fn a_motor_goes_to_the_limits_that_it_reports() -> Result<(), WorkerError> {
    let text = r#"<innerModel><transform id="arm"><joint id="elbow" axis="x" min="-1.57" max="1.57"/></transform></innerModel>"#;
    let (mut worker, mut test) = start(text);
    let motors = member(test.motors.get("arm"));
    let params = worker.get_all_motor_params(&mut test, &motors);
    for position in [params[0].max_pos, params[0].min_pos] {
        let goal = MotorGoalPosition {
            name: "elbow".to_owned(),
            position,
            max_speed: 0.0,
        };
        worker
            .set_position(&mut test, &motors, goal)
            .expect("a limit");
        worker.compute(&mut test)?;
        let state = worker.get_motor_state(&mut test, &motors, "elbow".into());
        assert_eq!(state.expect("a motor").pos, position);
    }
    Ok(())
}

const HALL: &str = r#"<innerModel>
    <plane id="wall" pz="2050" size="4000,4000,100" collide="1"/>
    <omnirobot id="omni" maxspeed="500">
        <cylinder id="hull" radius="200" length="300"/>
        <lidar id="lidar" max="9000" measures="360" rings="3" low="-0.1" high="0.1"/>
        <camera id="eye" width="64" height="48" focal="60"/>
        <imu id="imu"/>
    </omnirobot>
</innerModel>"#;

#[test]
fn a_lidar_has_the_axes_of_its_interface() {
    let (mut worker, mut test) = start(HALL);
    let lidar = member(test.lidars.get("lidar"));
    let all = worker.get_lidar_data(&mut test, &lidar, String::new(), 0.0, TAU, 1);
    // The wall is from −2 m to 2 m in front: a right angle, at both ends of which rays may miss it.
    assert!(
        (267..=273).contains(&all.points.len()),
        "{}",
        all.points.len()
    );
    for point in &all.points {
        assert!((point.y - 2000.0).abs() < 1e-2);
        assert!((point.distance2d - point.x.hypot(point.y)).abs() < 1e-2);
        assert!((point.phi - (-point.x).atan2(point.y)).abs() < 1e-4);
        assert!((point.theta.cos() - point.z / point.r).abs() < 1e-4);
    }
    let left = worker.get_lidar_data(&mut test, &lidar, "lidar".into(), 0.0, FRAC_PI_2, 1);
    assert!(left.points.iter().all(|point| point.x < 1.0) && left.points.len() > 120);
    let tenth = worker.get_lidar_data(&mut test, &lidar, String::new(), 0.0, TAU, 10);
    assert!(
        (27..=30).contains(&tenth.points.len()),
        "{}",
        tenth.points.len()
    );
    let near = worker.get_lidar_data_with_threshold2d(&mut test, &lidar, String::new(), 2100.0, 1);
    assert!(near.points.iter().all(|point| point.distance2d <= 2100.0) && near.points.len() > 90);
    let seen = worker.get_lidar_data_proyected_in_image(&mut test, &lidar, String::new());
    assert!(
        seen.points
            .iter()
            .all(|p| (0..64).contains(&p.pixel_x) && (0..48).contains(&p.pixel_y))
    );
    let lists = worker.get_lidar_data_array_proyected_in_image(&mut test, &lidar, String::new());
    assert!(lists.x_pixel.len() > 50 && lists.x_pixel.len() == seen.points.len());
    let other = worker.get_lidar_data(&mut test, &lidar, "other".into(), 0.0, TAU, 1);
    assert!(other.points.is_empty());
}

#[test]
fn an_omni_base_and_its_imu() -> Result<(), WorkerError> {
    let (mut worker, mut test) = start(HALL);
    let omni = member(test.omni_bases.get("omni"));
    OmniBases::set_speed_base(&mut worker, &mut test, &omni, 300.0, 400.0, 0.0).expect("a base");
    test.run(&mut worker, Duration::from_secs(1))?;
    let (x, z, alpha) = OmniBases::get_base_pose(&mut worker, &mut test, &omni).expect("a base");
    assert_eq!((x, z), (300, 400));
    assert!((alpha - FRAC_PI_2).abs() < 1e-6);
    let refused = OmniBases::set_speed_base(&mut worker, &mut test, &omni, f32::INFINITY, 0.0, 0.0);
    assert!(refused.is_err());
    OmniBases::stop_base(&mut worker, &mut test, &omni).expect("a base");
    test.run(&mut worker, Duration::from_millis(50))?;
    let imu = member(test.imus.get("imu"));
    let values = worker.get_data_imu(&mut test, &imu);
    assert!(
        (values.y_acc - 9.81).abs() < 1e-5 && values.x_acc.abs() < 1e-5,
        "{values:?}"
    );
    assert_eq!(worker.get_acceleration(&mut test, &imu).y_acc, values.y_acc);
    assert_eq!(worker.get_magneticfields(&mut test, &imu).z_mag, 1.0);
    OmniBases::set_speed_base(&mut worker, &mut test, &omni, 0.0, 0.0, 1.0).expect("a base");
    test.run(&mut worker, Duration::from_millis(500))?;
    assert!((worker.get_velangular(&mut test, &imu).y_gyr - 1.0).abs() < 1e-4);
    worker.reset_imu(&mut test, &imu);
    assert_eq!(worker.get_orientation(&mut test, &imu).yaw, 0.0);
    worker.compute(&mut test)?;
    assert!((worker.get_orientation(&mut test, &imu).yaw - 0.01).abs() < 1e-4);
    Ok(())
}
