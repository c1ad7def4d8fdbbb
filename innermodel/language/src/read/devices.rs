//! The elements of simulated devices.

use crate::attributes::Attributes;
use crate::model::{
    Battery, Camera, ColourCamera, Drive, Human, Imu, Kind, Laser, Lidar, Rgbd, Robot, Signal,
    TouchSensor, Ultrasound,
};

/// The kind of a device; `None` for another element.
pub(super) fn kind(tag: &str, from: &mut Attributes<'_, '_>) -> Option<Kind> {
    Some(match tag {
        "touchsensor" => {
            let (min, max) = from.limits(false);
            Kind::TouchSensor(TouchSensor {
                form: from.text("type"),
                normal: from.numbers(["nx", "ny", "nz"]),
                min,
                max,
                port: from.count("port", 0),
                signal: signal(from, false),
            })
        }
        "differentialrobot" => robot(Drive::Differential, from),
        "omnirobot" => robot(Drive::Omni, from),
        "camera" => Kind::Camera(ColourCamera {
            camera: camera(from),
            signal: signal(from, false),
        }),
        "rgbd" => Kind::Rgbd(Rgbd {
            camera: camera(from),
            signal: signal(from, true),
            port: from.count("port", 0),
            ifconfig: from.text("ifconfig"),
        }),
        "laser" => Kind::Laser(Laser {
            port: from.count("port", 0),
            min: from.length("min", 0.0),
            max: from.length("max", 0.0),
            angle: from.number("angle", 0.0),
            measures: from.count("measures", 0),
            ifconfig: from.text("ifconfig"),
            signal: signal(from, true),
        }),
        "lidar" => Kind::Lidar(Lidar {
            min: from.length("min", 0.0),
            max: from.length("max", 0.0),
            angle: from.number("angle", std::f64::consts::TAU),
            measures: from.count("measures", 0),
            rings: from.count("rings", 1),
            low: from.number("low", 0.0),
            high: from.number("high", 0.0),
            signal: signal(from, true),
        }),
        "ultrasound" => Kind::Ultrasound(Ultrasound {
            min: from.length("min", 0.0),
            max: from.length("max", 0.0),
            angle: from.number("angle", 0.0),
            signal: signal(from, true),
        }),
        "imu" => Kind::Imu(Imu {
            port: from.count("port", 0),
            gyro_noise: from.at_least_0("gyronoise", 0.0),
            signal: signal(from, false),
        }),
        "battery" => Kind::Battery(Battery {
            endurance: from.positive("endurance", Battery::ENDURANCE),
            charging: from.positive("charging", Battery::CHARGING),
            level: from.part("level", 1.0),
        }),
        "human" => Kind::Human(Human {
            path: from.path("path"),
            speed: from.length_at_least_0("speed", Human::SPEED),
            height: match from.length_at_least_0("height", Human::HEIGHT) {
                0.0 => Human::HEIGHT,
                height => height,
            },
        }),
        _ => return None,
    })
}

fn robot(drive: Drive, from: &mut Attributes<'_, '_>) -> Kind {
    Kind::Robot(Robot {
        drive,
        port: from.count("port", 0),
        // RoboComp ends if a noise is negative.
        noise: from.at_least_0("noise", 0.0),
        collide: from.flag("collide"),
        max_speed: from.length_at_least_0("maxspeed", Robot::MAX_SPEED),
        max_turn: from.at_least_0("maxturn", Robot::MAX_TURN),
        slip: from.part("slip", 0.0),
    })
}

/// How a sensor measures. The values of some sensors are lengths.
fn signal(from: &mut Attributes<'_, '_>, lengths: bool) -> Signal {
    let mut value = |name: &str| {
        if lengths {
            from.length_at_least_0(name, 0.0)
        } else {
            from.at_least_0(name, 0.0)
        }
    };
    Signal {
        noise: value("noise"),
        quantum: value("quantum"),
        drift: value("drift"),
        rate: from.at_least_0("rate", 0.0),
        dropout: from.part("dropout", 0.0),
        latency: from.at_least_0("latency", 0.0),
    }
}

fn camera(from: &mut Attributes<'_, '_>) -> Camera {
    Camera {
        width: from.pixels("width"),
        height: from.pixels("height"),
        focal: from.positive("focal", 0.0),
    }
}
