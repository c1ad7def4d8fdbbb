//! Errors of sensors.

use crate::{STEP, room, world};
use innermodel::InnerModel;
use innermodel::kinds::Signal;
use innermodel_simulation::{Random, SensorNoise, World};

#[test]
fn noise_has_its_deviation_and_no_mean() {
    let signal = Signal {
        noise: 12.0,
        ..Signal::default()
    };
    let mut errors = SensorNoise::new(&signal, Random::new(1, "a", 0), 0.0);
    let count = 100_000;
    let values: Vec<f64> = (0..count)
        .map(|_| errors.measure(1000.0).expect("no dropout") - 1000.0)
        .collect();
    let mean = values.iter().sum::<f64>() / f64::from(count);
    let sigma = (values.iter().map(|v| v * v).sum::<f64>() / f64::from(count)).sqrt();
    assert!(
        mean.abs() < 0.15 && (sigma / 12.0 - 1.0).abs() < 0.03,
        "{mean} {sigma}"
    );
}

#[test]
fn values_are_rounded_and_lost() {
    let signal = Signal {
        quantum: 25.0,
        dropout: 0.2,
        ..Signal::default()
    };
    let mut errors = SensorNoise::new(&signal, Random::new(1, "a", 0), 0.0);
    let values: Vec<Option<f64>> = (0..100_000)
        .map(|at| errors.measure(f64::from(at)))
        .collect();
    let lost = values.iter().filter(|value| value.is_none()).count();
    assert!((lost as f64 / 20_000.0 - 1.0).abs() < 0.03, "{lost}");
    for (at, value) in values.into_iter().enumerate() {
        if let Some(value) = value {
            assert!(value % 25.0 == 0.0 && (value - at as f64).abs() <= 12.5);
        }
    }
}

#[test]
fn drift_grows_with_the_root_of_time() {
    // 400 sensors drift for 4 s: the deviation is 2 times that of a second.
    let lasers: String = (0..400)
        .map(|at| format!(r#"<laser id="l{at}" max="90000" measures="1" drift="10" rate="10"/>"#))
        .collect();
    let inside = format!(r#"<transform id="stand" ty="500">{lasers}</transform>"#);
    let mut world = world(&room(&inside));
    world.run(400).expect("steps");
    let errors = (0..400).map(|at| {
        let scan = world.scan(&format!("l{at}")).expect("a scan");
        scan.ranges[0].distance - 2000.0
    });
    let sigma = (errors.map(|error| error * error).sum::<f64>() / 400.0).sqrt();
    // The deviation of a deviation of 400 numbers is 3.5 %.
    assert!((sigma / 20.0 - 1.0).abs() < 0.12, "{sigma}");
}

#[test]
fn a_seed_makes_runs_equal_bit_for_bit() {
    let inside = r#"<differentialrobot id="base" ty="200" noise="0.05" slip="0.02" collide="1">
            <cylinder id="hull" radius="200" length="300" collide="1"/>
            <laser id="scanner" max="9000" angle="6" measures="100" noise="10" dropout="0.1" drift="5"/>
            <imu id="imu" noise="0.1" gyronoise="0.01"/>
            <rgbd id="eye" width="32" height="24" focal="30" noise="3"/>
        </differentialrobot>"#;
    let run = |seed| {
        let model = InnerModel::parse(&room(inside)).expect("a right text");
        let mut world = World::new(model, STEP, seed).expect("a world");
        let speed = innermodel_simulation::Speed {
            advance: 400.0,
            turn: 0.5,
            ..Default::default()
        };
        world.drive("base", speed).expect("a robot");
        world.run(200).expect("steps");
        let scan = world.scan("scanner").expect("a scan");
        let inertia = world.imu("imu").expect("values");
        let picture = world.picture("eye").expect("a picture");
        let text = format!(
            "{scan:?} {inertia:?} {:?} {:?}",
            picture.image,
            world.base("base")
        );
        (world.digest(), text)
    };
    assert_eq!(run(7), run(7));
    assert_ne!(run(7).1, run(8).1);
}

#[test]
fn errors_of_a_sensor_change_at_run_time() {
    let inside = r#"<transform id="stand" ty="500"><laser id="scanner" max="90000" measures="1"/></transform>"#;
    let mut world = world(&room(inside));
    let mut signal = world.signal("scanner").expect("a sensor");
    signal.quantum = 300.0;
    world
        .set_signal("scanner", signal.clone())
        .expect("a sensor");
    world.step().expect("a step");
    assert_eq!(
        world.scan("scanner").expect("a scan").ranges[0].distance,
        2100.0
    );
    signal.dropout = 1.5;
    let error = world.set_signal("scanner", signal.clone()).unwrap_err();
    assert_eq!(
        error.to_string(),
        "the numbers of the signal of `scanner` must be at least 0, and `dropout` at most 1"
    );
    signal.dropout = f64::NAN;
    assert!(world.set_signal("scanner", signal.clone()).is_err());
    assert!(world.set_signal("floor", Signal::default()).is_err());
}
