//! Serves the simulated robot: its scanner, its base and its true pose.

use crate::battery::Battery;
use crate::lidar::Lidar;
use crate::world::{Robot, Simulation, Speed};
use planar_map::{Map, Pose, libm};
use simulator_generated::tracing::{info, warn};
use simulator_generated::{
    BatteryStatus, Context, DifferentialRobot, FullPoseEuler, GetBasePoseError, GetBaseStateError,
    GetBatteryStateError, Laser, LaserConfData, TBaseState, TBattery, TData, TMechParams, Worker,
    WorkerError,
};

/// The simulated world, and when its time passes.
pub struct SpecificWorker {
    simulation: Simulation,
    battery: Battery,
    lockstep: bool,
}

impl Worker<Context> for SpecificWorker {
    fn initialize(ctx: &mut Context) -> Result<Self, WorkerError> {
        let params = &ctx.params;
        let map = Map::load(&params.map)?;
        let lidar = Lidar {
            beams: u16::try_from(params.laser.beams).unwrap_or(u16::MAX),
            field_of_view: params.laser.field_of_view,
            max_range: params.laser.max_range,
            noise: params.laser.noise,
        };
        let fastest = Speed {
            advance: params.robot.max_speed,
            turn: params.robot.max_turn,
        };
        let robot = Robot {
            radius: params.robot.radius,
            fastest,
            lidar,
        };
        let simulation = Simulation::new(&map, robot, params.step.as_secs_f64(), params.seed)
            .map_err(|why| WorkerError::Fatal(format!("{}: {why}", params.map.display())))?;
        info!(
            "{}: {} walls and edges",
            params.map.display(),
            map.segments().len()
        );
        let battery = &params.battery;
        Ok(Self {
            simulation,
            battery: Battery::new(
                battery.endurance.as_secs_f64(),
                battery.charging.as_secs_f64(),
            ),
            lockstep: params.lockstep,
        })
    }

    fn compute(&mut self, ctx: &mut Context) -> Result<(), WorkerError> {
        if !self.lockstep {
            self.step(ctx)?;
        }
        Ok(())
    }
}

impl SpecificWorker {
    fn step(&mut self, ctx: &mut Context) -> Result<(), WorkerError> {
        if self.battery.is_empty() {
            self.simulation.ask(Speed::default());
        }
        self.simulation.step();
        let stands = self.simulation.wanted == Speed::default();
        self.battery.step(ctx.params.step.as_secs_f64(), stands);
        ctx.full_pose_estimation_pub
            .new_full_pose(&self.full_pose())?;
        Ok(())
    }

    fn full_pose(&self) -> FullPoseEuler {
        let (pose, actual) = (self.simulation.pose, self.simulation.actual);
        let (vx, vy) = along(pose, actual.advance);
        FullPoseEuler {
            source: "simulator".to_owned(),
            x: pose.x as f32,
            y: pose.y as f32,
            rz: pose.heading as f32,
            vx,
            vy,
            vrz: actual.turn as f32,
            confidence: 100,
            ..FullPoseEuler::default()
        }
    }

    fn base_state(&self) -> TBaseState {
        let Simulation {
            odometer,
            corrected,
            actual,
            wanted,
            ..
        } = &self.simulation;
        let (adv_vx, adv_vz) = along(*odometer, actual.advance);
        TBaseState {
            x: odometer.x as f32,
            corrected_x: corrected.x as f32,
            z: odometer.y as f32,
            corrected_z: corrected.y as f32,
            alpha: odometer.heading as f32,
            corrected_alpha: corrected.heading as f32,
            adv_vx,
            adv_vz,
            rot_v: actual.turn as f32,
            is_moving: *wanted != Speed::default(),
        }
    }
}

/// A speed along the heading as its parts along the axes.
fn along(pose: Pose, advance: f64) -> (f32, f32) {
    let (sin, cos) = libm::sincos(pose.heading);
    ((advance * cos) as f32, (advance * sin) as f32)
}

/// A pose as the wire has it: whole millimetres.
fn pose(x: i32, z: i32, alpha: f32) -> Pose {
    Pose::new(f64::from(x), f64::from(z), f64::from(alpha))
}

impl Laser<Context> for SpecificWorker {
    fn get_laser_data(&mut self, _ctx: &mut Context) -> Vec<TData> {
        let measure = |angle: f64, distance: f64| TData {
            angle: angle as f32,
            dist: distance as f32,
        };
        self.simulation
            .scan()
            .iter()
            .map(|beam| measure(beam.angle, beam.distance))
            .collect()
    }

    fn get_laser_and_b_state_data(&mut self, ctx: &mut Context) -> (Vec<TData>, TBaseState) {
        (self.get_laser_data(ctx), self.base_state())
    }

    fn get_laser_conf_data(&mut self, ctx: &mut Context) -> LaserConfData {
        let lidar = self.simulation.robot().lidar;
        LaserConfData {
            driver: "simulator".to_owned(),
            device: ctx.params.map.display().to_string(),
            static_conf: 1,
            max_measures: i32::from(lidar.beams),
            max_degrees: lidar.field_of_view.to_degrees().round() as i32,
            max_range: lidar.max_range as i32,
            min_range: 0,
            ini_range: 0,
            end_range: i32::from(lidar.beams) - 1,
            cluster: 1,
            sample_rate: ctx.params.step.as_millis() as i32,
            angle_res: lidar.resolution() as f32,
            angle_ini: (-lidar.field_of_view / 2.0) as f32,
        }
    }
}

impl DifferentialRobot<Context> for SpecificWorker {
    fn get_base_state(&mut self, _ctx: &mut Context) -> Result<TBaseState, GetBaseStateError> {
        Ok(self.base_state())
    }

    fn get_base_pose(&mut self, _ctx: &mut Context) -> Result<(i32, i32, f32), GetBasePoseError> {
        let Pose { x, y, heading } = self.simulation.odometer;
        Ok((x.round() as i32, y.round() as i32, heading as f32))
    }

    fn get_mech_params(&mut self, _ctx: &mut Context) -> TMechParams {
        let robot = self.simulation.robot();
        TMechParams {
            axis_length: (2.0 * robot.radius) as i32,
            handler: "simulator".to_owned(),
            max_vel_adv: robot.fastest.advance as f32,
            max_vel_rot: robot.fastest.turn as f32,
            ..TMechParams::default()
        }
    }

    fn set_speed_base(&mut self, ctx: &mut Context, adv: f32, rot: f32) {
        self.simulation.ask(Speed {
            advance: f64::from(adv),
            turn: f64::from(rot),
        });
        if self.lockstep
            && let Err(error) = self.step(ctx)
        {
            warn!(
                "the pose of step {} was not published: {error}",
                self.simulation.steps
            );
        }
    }

    fn stop_base(&mut self, _ctx: &mut Context) {
        self.simulation.ask(Speed::default());
    }

    fn reset_odometer(&mut self, _ctx: &mut Context) {
        self.simulation.odometer = Pose::default();
    }

    fn set_odometer(&mut self, _ctx: &mut Context, state: TBaseState) {
        let pose = |x, z, alpha| Pose::new(f64::from(x), f64::from(z), f64::from(alpha));
        self.simulation.odometer = pose(state.x, state.z, state.alpha);
        self.simulation.corrected =
            pose(state.corrected_x, state.corrected_z, state.corrected_alpha);
    }

    fn set_odometer_pose(&mut self, _ctx: &mut Context, x: i32, z: i32, alpha: f32) {
        self.simulation.odometer = pose(x, z, alpha);
    }

    fn correct_odometer(&mut self, _ctx: &mut Context, x: i32, z: i32, alpha: f32) {
        self.simulation.corrected = pose(x, z, alpha);
    }
}

impl BatteryStatus<Context> for SpecificWorker {
    fn get_battery_state(&mut self, _ctx: &mut Context) -> Result<TBattery, GetBatteryStateError> {
        Ok(self.battery.state())
    }
}
