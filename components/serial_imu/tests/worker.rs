//! The driver at a pseudo-terminal: the test is the sensor.

use rustix::fs::{Mode, OFlags};
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use rustix::termios::tcgetattr;
use serial_imu::SpecificWorker;
use serial_imu_generated::lifecycle::Transition;
use serial_imu_generated::testing::TestContext;
use serial_imu_generated::{Imu, Worker, WorkerError};
use std::ffi::OsStr;
use std::os::fd::OwnedFd;
use std::os::unix::ffi::OsStrExt;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

const PERIOD: Duration = Duration::from_millis(10);

/// A sensor at the other end of a port. The port's path is a link, as udev makes them.
struct Sensor {
    wire: Option<OwnedFd>,
    folder: PathBuf,
}

impl Sensor {
    fn new(name: &str) -> Self {
        let folder = format!("serial_imu-{}-{name}", std::process::id());
        let folder = std::env::temp_dir().join(folder);
        std::fs::create_dir_all(&folder).expect("a folder");
        let mut sensor = Self { wire: None, folder };
        sensor.plug_in();
        sensor
    }

    fn path(&self) -> PathBuf {
        self.folder.join("imu")
    }

    fn plug_in(&mut self) {
        let flags = OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC;
        let wire = openpt(flags).expect("a pseudo-terminal");
        grantpt(&wire)
            .and_then(|()| unlockpt(&wire))
            .expect("a port");
        let port = ptsname(&wire, Vec::new()).expect("a name");
        let port = Path::new(OsStr::from_bytes(port.to_bytes())).to_owned();
        std::os::unix::fs::symlink(port, self.path()).expect("a link");
        self.wire = Some(wire);
    }

    fn unplug(&mut self) {
        std::fs::remove_file(self.path()).expect("the link");
        self.wire = None;
    }

    fn send(&self, bytes: &[u8]) {
        let wire = self.wire.as_ref().expect("it is plugged in");
        let mut rest = bytes;
        while !rest.is_empty() {
            let count = rustix::io::write(wire, rest).expect("a wire");
            rest = &rest[count..];
        }
    }

    /// A valid line with this yaw, in degrees to the right.
    fn turn(&self, yaw: f32) {
        let text = format!(
            "VNYMR,{yaw:+08.3},+002.000,-003.000,+1.0,+2.0,+3.0,+00.100,+00.200,-09.810,+0.1,+0.2,+0.3"
        );
        let sum = text.bytes().fold(0, |sum, byte| sum ^ byte);
        self.send(format!("${text}*{sum:02X}\r\n").as_bytes());
    }
}

impl Drop for Sensor {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.folder);
    }
}

/// A worker that is active at the port of a sensor.
fn active(sensor: &Sensor) -> (TestContext, SpecificWorker) {
    let mut test = TestContext::configured().expect("a configuration");
    test.params.device = sensor.path();
    let mut worker = SpecificWorker::initialize(&mut test).expect("a worker");
    for transition in [Transition::Configure, Transition::Activate] {
        let changed = test.transition(&mut worker, transition);
        changed.expect("it opens the port");
    }
    // The line that was under way when the port was opened.
    sensor.send(b"12,+0.34*00\r\n");
    (test, worker)
}

/// Runs periods until the worker has a yaw, or none. The kernel passes bytes on when it likes.
fn until(test: &mut TestContext, worker: &mut SpecificWorker, known: bool) {
    let begun = Instant::now();
    loop {
        // Errors of a missing device are expected.
        let _ = worker.compute(test);
        let yaw = worker.get_orientation(test).yaw;
        if yaw.is_nan() != known {
            return;
        }
        assert!(begun.elapsed() < Duration::from_secs(20), "yaw is {yaw}");
        test.advance(PERIOD);
        std::thread::yield_now();
    }
}

#[test]
fn values_have_the_axes_of_the_interface() {
    let sensor = Sensor::new("axes");
    let (mut test, mut worker) = active(&sensor);
    assert!(
        worker.get_acceleration(&mut test).x_acc.is_nan(),
        "no line came"
    );
    sensor.turn(90.0);
    until(&mut test, &mut worker, true);
    let data = worker.get_data_imu(&mut test);
    // The sensor lies flat, so that upwards is +9.81.
    assert_eq!((data.x_acc, data.y_acc, data.z_acc), (0.2, 9.81, 0.1));
    assert_eq!((data.x_mag, data.y_mag, data.z_mag), (2.0, -3.0, 1.0));
    assert_eq!((data.x_gyr, data.y_gyr, data.z_gyr), (-0.2, -0.3, -0.1));
    let right = -std::f32::consts::FRAC_PI_2;
    assert!((data.yaw - right).abs() < 1e-6, "{data:?}");
    assert!((data.pich + 2_f32.to_radians()).abs() < 1e-6, "{data:?}");
    assert!((data.roll - 3_f32.to_radians()).abs() < 1e-6, "{data:?}");
    worker.reset_imu(&mut test);
    assert_eq!(worker.get_orientation(&mut test).yaw, 0.0);
    // 350 degrees is 100 to the left of 90.
    test.advance(Duration::from_secs(1));
    sensor.turn(350.0);
    until(&mut test, &mut worker, true);
    let yaw = worker.get_orientation(&mut test).yaw.to_degrees();
    assert!((yaw - 100.0).abs() < 1e-3, "{yaw}");
}

#[test]
fn noise_hides_no_line_and_makes_none() {
    let sensor = Sensor::new("noise");
    let (mut test, mut worker) = active(&sensor);
    sensor.send(b"\x00\xfe$VN\n$VNYMR,+1,+2*00\n\xff\xff\xff");
    sensor.turn(10.0);
    until(&mut test, &mut worker, true);
    let yaw = worker.get_orientation(&mut test).yaw.to_degrees();
    assert!((yaw + 10.0).abs() < 1e-3, "{yaw}");
    // Nothing but noise: after the silence, the port is opened again, and the error says why.
    test.advance(Duration::from_millis(300));
    let begun = Instant::now();
    let error = loop {
        sensor.send(b"\x80\x81\x82\r\n");
        match worker.compute(&mut test) {
            Err(WorkerError::Failed(text)) if text.contains("no valid line") => break text,
            Err(other) => panic!("{other}"),
            Ok(()) => test.advance(PERIOD),
        }
        assert!(begun.elapsed() < Duration::from_secs(20));
    };
    assert!(error.contains("at 115200 Bd?"), "{error}");
    assert!(worker.get_orientation(&mut test).yaw.is_nan(), "old values");
}

#[test]
fn a_sensor_that_is_unplugged_comes_back() {
    let mut sensor = Sensor::new("unplugged");
    let (mut test, mut worker) = active(&sensor);
    sensor.turn(10.0);
    until(&mut test, &mut worker, true);
    sensor.unplug();
    until(&mut test, &mut worker, false);
    sensor.plug_in();
    let begun = Instant::now();
    while worker.get_orientation(&mut test).yaw.is_nan() {
        sensor.turn(20.0);
        let _ = worker.compute(&mut test);
        test.advance(PERIOD);
        assert!(begun.elapsed() < Duration::from_secs(20));
    }
    // It is gone for longer than `give_up`: the component ends.
    sensor.unplug();
    let mut periods = 0;
    let end = loop {
        match worker.compute(&mut test) {
            Err(WorkerError::Fatal(text)) => break text,
            Ok(()) | Err(_) => test.advance(PERIOD),
        }
        periods += 1;
        assert!(periods < 4000, "30 s have 3000 periods");
    };
    assert!(end.starts_with("no values for 30"), "{end}");
    assert!(periods >= 2900, "{periods}");
}

#[test]
fn a_start_without_a_sensor_says_what_is_wrong() {
    let mut sensor = Sensor::new("missing");
    sensor.unplug();
    let try_to_open = |path: &Path| {
        let mut test = TestContext::configured().expect("a configuration");
        test.params.device = path.to_owned();
        let mut worker = SpecificWorker::initialize(&mut test).expect("a worker");
        let error = worker.configure(&mut test).expect_err("there is no port");
        error.to_string()
    };
    let error = try_to_open(&sensor.path());
    assert!(error.contains("is it plugged in?"), "{error}");
    std::fs::write(sensor.path(), "").expect("a file");
    let error = try_to_open(&sensor.path());
    assert!(error.contains("this is no serial port"), "{error}");
}

#[test]
fn the_port_has_the_settings_of_the_sensor_and_one_reader() {
    let sensor = Sensor::new("settings");
    let (mut test, _worker) = active(&sensor);
    let flags = OFlags::RDONLY | OFlags::NOCTTY | OFlags::NONBLOCK;
    // root may open a port that another process has for itself.
    if let Ok(port) = rustix::fs::open(sensor.path(), flags, Mode::empty()) {
        let settings = tcgetattr(&port).expect("settings");
        assert_eq!(settings.input_speed(), 115_200);
        assert!(rustix::process::geteuid().is_root());
    } else {
        let mut other = SpecificWorker::initialize(&mut test).expect("a worker");
        let error = other.configure(&mut test).expect_err("one reader");
        assert!(error.to_string().contains("another program"), "{error}");
    }
}
