//! Simulated devices: sensors, bases, batteries and people.

/// The errors of a simulated sensor. Everything is 0 in a sensor without errors.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Signal {
    /// Measurements in a second; 0: one in each step of the simulation.
    pub rate: f64,
    /// The standard deviation of a value, in its unit: millimetres of a range, grey levels of a
    /// colour, m/s² of an acceleration.
    pub noise: f64,
    /// Values are multiples of it. 0: they are not rounded.
    pub quantum: f64,
    /// The probability that a value is lost, from 0 to 1.
    pub dropout: f64,
    /// The standard deviation by which the error that all values share drifts in a second. The
    /// drift grows with the root of time.
    pub drift: f64,
    /// How long after its measurement a value can be read, in seconds.
    pub latency: f64,
}

/// A touch sensor.
#[derive(Clone, Debug, PartialEq)]
pub struct TouchSensor {
    /// The attribute `type`.
    pub form: String,
    /// The direction that it feels.
    pub normal: [f64; 3],
    /// The least value.
    pub min: f64,
    /// The greatest value.
    pub max: f64,
    /// The port of its server in RoboComp.
    pub port: u32,
    /// Its errors.
    pub signal: Signal,
}

/// The drive of a base.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Drive {
    /// Two driven wheels.
    Differential,
    /// Also sideways.
    Omni,
}

/// A base that drives.
#[derive(Clone, Debug, PartialEq)]
pub struct Robot {
    /// Its drive.
    pub drive: Drive,
    /// The port of its server in RoboComp.
    pub port: u32,
    /// The standard deviation of the odometry's error, as a part of the way.
    pub noise: f64,
    /// Whether obstacles stop it.
    pub collide: bool,
    /// The greatest speed in mm/s.
    pub max_speed: f64,
    /// The greatest speed of turning in rad/s.
    pub max_turn: f64,
    /// The part of the wheels' way that the base does not move, from 0 to 1.
    pub slip: f64,
}

impl Robot {
    /// The greatest speed of a robot whose file gives none, in mm/s.
    pub const MAX_SPEED: f64 = 1000.0;
    /// The greatest speed of turning of a robot whose file gives none, in rad/s.
    pub const MAX_TURN: f64 = 3.0;

    /// A robot that obstacles do not stop, without errors.
    pub fn new(drive: Drive) -> Self {
        Self {
            drive,
            port: 0,
            noise: 0.0,
            collide: false,
            max_speed: Self::MAX_SPEED,
            max_turn: Self::MAX_TURN,
            slip: 0.0,
        }
    }
}

/// A camera. It looks along +z: u = cx + f·x/z, v = cy − f·y/z, with the centre in the middle.
#[derive(Clone, Debug, PartialEq)]
pub struct Camera {
    /// In pixels.
    pub width: f64,
    /// In pixels.
    pub height: f64,
    /// In pixels.
    pub focal: f64,
}

/// A camera without depth.
#[derive(Clone, Debug, PartialEq)]
pub struct ColourCamera {
    /// Image of the camera.
    pub camera: Camera,
    /// The errors of its colours.
    pub signal: Signal,
}

/// A camera with depth.
#[derive(Clone, Debug, PartialEq)]
pub struct Rgbd {
    /// Image of the camera.
    pub camera: Camera,
    /// The errors of its depths. Its colours have none.
    pub signal: Signal,
    /// The port of its server in RoboComp.
    pub port: u32,
    /// Kept for RoboComp's simulator, which reads it.
    pub ifconfig: String,
}

/// A laser in the plane y = 0. A point at range r and angle a is (r sin a, 0, r cos a); the first
/// measure is at +angle/2, the last one at −angle/2.
#[derive(Clone, Debug, PartialEq)]
pub struct Laser {
    /// The port of its server in RoboComp.
    pub port: u32,
    /// The least range in millimetres.
    pub min: f64,
    /// The greatest range in millimetres.
    pub max: f64,
    /// The opening angle in radians.
    pub angle: f64,
    /// How many points a sweep has.
    pub measures: u32,
    /// Kept for RoboComp's simulator, which reads it.
    pub ifconfig: String,
    /// Its errors.
    pub signal: Signal,
}

/// A laser that measures in several planes. The ring of elevation e has the points
/// (r cos e sin a, r sin e, r cos e cos a). Rings go from `low` to `high`, and a from +angle/2 to
/// −angle/2. A whole turn has no second point at its end.
#[derive(Clone, Debug, PartialEq)]
pub struct Lidar {
    /// The least range in millimetres.
    pub min: f64,
    /// The greatest range in millimetres.
    pub max: f64,
    /// The opening angle of a ring in radians.
    pub angle: f64,
    /// How many points a ring has.
    pub measures: u32,
    /// How many rings there are.
    pub rings: u32,
    /// The elevation of the lowest ring in radians.
    pub low: f64,
    /// The elevation of the highest ring in radians.
    pub high: f64,
    /// Its errors.
    pub signal: Signal,
}

/// A sensor that measures the nearest range in a cone about +z.
#[derive(Clone, Debug, PartialEq)]
pub struct Ultrasound {
    /// The least range in millimetres.
    pub min: f64,
    /// The greatest range in millimetres.
    pub max: f64,
    /// The opening angle of the cone in radians.
    pub angle: f64,
    /// Its errors.
    pub signal: Signal,
}

/// Measures acceleration and turning.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Imu {
    /// The port of its server in RoboComp.
    pub port: u32,
    /// The standard deviation of a speed of turning in rad/s.
    pub gyro_noise: f64,
    /// The errors of its accelerations.
    pub signal: Signal,
}

/// The battery of the robot that it is below.
#[derive(Clone, Debug, PartialEq)]
pub struct Battery {
    /// How long a full one lasts while the robot moves, in seconds.
    pub endurance: f64,
    /// How long an empty one takes to charge while the robot stands, in seconds.
    pub charging: f64,
    /// The level at the start, from 0 to 1.
    pub level: f64,
}

impl Battery {
    /// Two hours.
    pub const ENDURANCE: f64 = 7200.0;
    /// A third of an hour.
    pub const CHARGING: f64 = 1200.0;
}

/// A person who walks along a path, again and again. A simulation adds a skeleton with bodies.
#[derive(Clone, Debug, PartialEq)]
pub struct Human {
    /// Points x, z in the parent, in millimetres. Fewer than two: the person stands.
    pub path: Vec<[f64; 2]>,
    /// The speed of walking in mm/s.
    pub speed: f64,
    /// The height of the person in millimetres.
    pub height: f64,
}

impl Human {
    /// The height of a person whose file gives none, in millimetres.
    pub const HEIGHT: f64 = 1750.0;
    /// The speed of a person whose file gives none, in mm/s.
    pub const SPEED: f64 = 1000.0;
}
