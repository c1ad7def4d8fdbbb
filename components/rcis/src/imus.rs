//! Inertial sensors.

use crate::SpecificWorker;
use innermodel_simulation::ImuSample;
use rcis_generated::{Acceleration, Context, DataImu, Imus, Magnetic, Member, Orientation, Wgyr};
use std::f64::consts::{PI, TAU};

impl SpecificWorker {
    fn inertia(&mut self, member: &Member) -> Option<ImuSample> {
        let sample = self.worlds.main.imu(member.name());
        self.warnings.or_default(sample.map(Some))
    }
}

fn parts(vector: &innermodel::Vector) -> [f32; 3] {
    [vector.x as f32, vector.y as f32, vector.z as f32]
}

/// The speed of turning of the interface, which about y grows to the left.
fn turning(inertia: &ImuSample) -> [f32; 3] {
    let [x, y, z] = parts(&inertia.turning);
    [x, -y, z]
}

impl Imus<Context> for SpecificWorker {
    fn get_data_imu(&mut self, ctx: &mut Context, member: &Member) -> DataImu {
        let Some(inertia) = self.inertia(member) else {
            return DataImu::default();
        };
        let [x_acc, y_acc, z_acc] = parts(&inertia.acceleration);
        let [x_gyr, y_gyr, z_gyr] = turning(&inertia);
        let [x_mag, y_mag, z_mag] = parts(&inertia.north);
        let Orientation { roll, pich, yaw } = self.get_orientation(ctx, member);
        DataImu {
            x_acc,
            y_acc,
            z_acc,
            x_gyr,
            y_gyr,
            z_gyr,
            x_mag,
            y_mag,
            z_mag,
            roll,
            pich,
            yaw,
            temperature: 25.0,
        }
    }

    fn get_acceleration(&mut self, _ctx: &mut Context, member: &Member) -> Acceleration {
        let Some(inertia) = self.inertia(member) else {
            return Acceleration::default();
        };
        let [x_acc, y_acc, z_acc] = parts(&inertia.acceleration);
        Acceleration {
            x_acc,
            y_acc,
            z_acc,
        }
    }

    fn get_velangular(&mut self, _ctx: &mut Context, member: &Member) -> Wgyr {
        let Some(inertia) = self.inertia(member) else {
            return Wgyr::default();
        };
        let [x_gyr, y_gyr, z_gyr] = turning(&inertia);
        Wgyr {
            x_gyr,
            y_gyr,
            z_gyr,
        }
    }

    fn get_magneticfields(&mut self, _ctx: &mut Context, member: &Member) -> Magnetic {
        let Some(inertia) = self.inertia(member) else {
            return Magnetic::default();
        };
        let [x_mag, y_mag, z_mag] = parts(&inertia.north);
        Magnetic {
            x_mag,
            y_mag,
            z_mag,
        }
    }

    /// Roll is about z, pitch about x of the tree. Yaw is about y, to the left.
    fn get_orientation(&mut self, _ctx: &mut Context, member: &Member) -> Orientation {
        let Some(inertia) = self.inertia(member) else {
            return Orientation::default();
        };
        let [x, y, z] = inertia.orientation;
        let zero = self.yaws.get(member.name()).copied().unwrap_or(0.0);
        Orientation {
            roll: z as f32,
            pich: x as f32,
            // From −π to π.
            yaw: (zero - y + PI).rem_euclid(TAU) as f32 - std::f32::consts::PI,
        }
    }

    fn reset_imu(&mut self, _ctx: &mut Context, member: &Member) {
        if let Some(inertia) = self.inertia(member) {
            let yaw = inertia.orientation[1];
            self.yaws.insert(member.name().to_owned(), yaw);
        }
    }
}
