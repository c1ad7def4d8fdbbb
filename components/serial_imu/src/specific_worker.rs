//! Serves the values of the sensor, and opens its port again when the sensor is unplugged or silent.

use crate::line::{Line, Lines, Sample};
use crate::port::Port;
use serial_imu_generated::network_time::Time;
use serial_imu_generated::tracing::{info, warn};
use serial_imu_generated::{
    Acceleration, Context, DataImu, Imu, Magnetic, Orientation, Wgyr, Worker, WorkerError,
};
use std::f32::consts::{PI, TAU};
use std::time::Duration;

/// The pauses between two attempts to open the port: they grow from the first to the second one.
const PAUSES: (Duration, Duration) = (Duration::from_millis(100), Duration::from_secs(5));

/// The port and the last values.
pub struct SpecificWorker {
    port: Option<Port>,
    lines: Lines,
    /// The last values, and when they came.
    last: Option<(Time, Sample)>,
    /// Since when no valid line has come.
    silent: Time,
    /// When the port was opened.
    opened: Time,
    /// Damaged lines since then.
    damaged: u32,
    /// Why the port is not open.
    trouble: String,
    /// When the port may be opened again, and the pause after the next failure.
    next: (Time, Duration),
    /// The yaw that counts as zero, in rad to the left.
    zero: f32,
}

impl Worker<Context> for SpecificWorker {
    fn initialize(ctx: &mut Context) -> Result<Self, WorkerError> {
        Ok(Self {
            port: None,
            lines: Lines::default(),
            last: None,
            silent: ctx.now(),
            opened: ctx.now(),
            damaged: 0,
            trouble: String::new(),
            next: (ctx.now(), PAUSES.0),
            zero: 0.0,
        })
    }

    /// A sensor that is missing at the start keeps the network from starting.
    fn configure(&mut self, ctx: &mut Context) -> Result<(), WorkerError> {
        self.last = None;
        self.open(ctx).map_err(WorkerError::Failed)
    }

    /// What came meanwhile is old.
    fn activate(&mut self, ctx: &mut Context) -> Result<(), WorkerError> {
        self.silent = ctx.now();
        self.opened = ctx.now();
        self.lines = Lines::in_the_middle();
        if let Some(port) = &self.port {
            // The next period reports a device that is gone.
            let _ = port.receive(|_| ());
        }
        Ok(())
    }

    fn compute(&mut self, ctx: &mut Context) -> Result<(), WorkerError> {
        let read = self.read(ctx);
        let lost = ctx.now() - self.silent;
        let Err(reason) = read else {
            return Ok(());
        };
        if lost > ctx.params.give_up {
            let text = format!("no values for {lost:.1?}: {reason}");
            return Err(WorkerError::Fatal(text));
        }
        Err(WorkerError::Failed(reason))
    }

    fn cleanup(&mut self, _ctx: &mut Context) -> Result<(), WorkerError> {
        self.port = None;
        Ok(())
    }
}

impl SpecificWorker {
    fn open(&mut self, ctx: &mut Context) -> Result<(), String> {
        let params = &ctx.params;
        self.port = Some(Port::open(&params.device, params.baud_rate.unsigned_abs())?);
        self.lines = Lines::in_the_middle();
        self.opened = ctx.now();
        self.damaged = 0;
        Ok(())
    }

    /// Reads what has come. Fails while there is no device, or it sends nothing that is valid.
    fn read(&mut self, ctx: &mut Context) -> Result<(), String> {
        let now = ctx.now();
        if self.port.is_none() {
            if now < self.next.0 {
                return Err(self.trouble.clone());
            }
            let (_, pause) = self.next;
            self.next = (now + pause, PAUSES.1.min(2 * pause));
            if let Err(reason) = self.open(ctx) {
                self.trouble.clone_from(&reason);
                return Err(reason);
            }
            info!("{} is open again", ctx.params.device.display());
        }
        let Some(port) = &self.port else {
            return Ok(());
        };
        let (mut newest, mut damaged) = (None, 0);
        let lines = &mut self.lines;
        let received = port.receive(|bytes| {
            lines.add(bytes, |line| match line {
                Line::Sample(sample) => newest = Some(sample),
                Line::Other => {}
                Line::Damaged => damaged += 1,
            });
        });
        if damaged > 0 && self.damaged == 0 {
            warn!("the first damaged line since the port was opened");
        }
        self.damaged = self.damaged.saturating_add(damaged);
        if let Some(sample) = newest {
            self.last = Some((now, sample));
            self.silent = now;
            self.next = (now, PAUSES.0);
        }
        let device = ctx.params.device.display();
        if let Err(reason) = received {
            return self.close(format!("{device}: {reason}"));
        }
        let quiet = now - self.silent.max(self.opened);
        if quiet < ctx.params.silence {
            return Ok(());
        }
        let reason = match self.damaged {
            0 => format!("{device}: no line for {quiet:.1?}"),
            count => format!(
                "{device}: no valid line for {quiet:.1?}, and {count} damaged ones; does the sensor send $VNYMR at {} Bd?",
                ctx.params.baud_rate
            ),
        };
        self.close(reason)
    }

    /// Closes the port, which is opened again later.
    fn close(&mut self, reason: String) -> Result<(), String> {
        self.port = None;
        self.trouble.clone_from(&reason);
        Err(reason)
    }

    /// The values of now.
    fn sample(&self, ctx: &Context) -> Option<&Sample> {
        let (at, sample) = self.last.as_ref()?;
        (ctx.now() - *at <= ctx.params.fresh).then_some(sample)
    }

    /// A vector of the sensor, whose axes are ahead, right and down, in those of the interface: right,
    /// up and ahead.
    fn vector(&self, ctx: &Context, of: impl Fn(&Sample) -> [f32; 3]) -> [f32; 3] {
        let sample = self.sample(ctx);
        sample.map_or([f32::NAN; 3], |sample| {
            let [ahead, right, down] = of(sample);
            [right, -down, ahead]
        })
    }

    /// Speeds of turning have the senses of RCIS: front down, to the left, right side up.
    fn turning(&self, ctx: &Context) -> [f32; 3] {
        let sample = self.sample(ctx);
        sample.map_or([f32::NAN; 3], |sample| {
            let [ahead, right, down] = sample.turning;
            [-right, -down, -ahead]
        })
    }
}

/// From −π to π.
fn wrapped(angle: f32) -> f32 {
    (angle + PI).rem_euclid(TAU) - PI
}

impl Imu<Context> for SpecificWorker {
    /// A line has no temperature.
    fn get_data_imu(&mut self, ctx: &mut Context) -> DataImu {
        let [x_acc, y_acc, z_acc] = self.vector(ctx, |sample| sample.acceleration);
        let [x_mag, y_mag, z_mag] = self.vector(ctx, |sample| sample.magnetic);
        let [x_gyr, y_gyr, z_gyr] = self.turning(ctx);
        let Orientation { roll, pich, yaw } = self.get_orientation(ctx);
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
            temperature: f32::NAN,
        }
    }

    fn get_acceleration(&mut self, ctx: &mut Context) -> Acceleration {
        let [x_acc, y_acc, z_acc] = self.vector(ctx, |sample| sample.acceleration);
        Acceleration {
            x_acc,
            y_acc,
            z_acc,
        }
    }

    fn get_velangular(&mut self, ctx: &mut Context) -> Wgyr {
        let [x_gyr, y_gyr, z_gyr] = self.turning(ctx);
        Wgyr {
            x_gyr,
            y_gyr,
            z_gyr,
        }
    }

    fn get_magneticfields(&mut self, ctx: &mut Context) -> Magnetic {
        let [x_mag, y_mag, z_mag] = self.vector(ctx, |sample| sample.magnetic);
        Magnetic {
            x_mag,
            y_mag,
            z_mag,
        }
    }

    /// Angles of turns about moving axes: yaw first, then pitch, then roll.
    fn get_orientation(&mut self, ctx: &mut Context) -> Orientation {
        let Some(sample) = self.sample(ctx) else {
            return Orientation {
                roll: f32::NAN,
                pich: f32::NAN,
                yaw: f32::NAN,
            };
        };
        Orientation {
            roll: -sample.roll.to_radians(),
            pich: -sample.pitch.to_radians(),
            yaw: wrapped(-sample.yaw.to_radians() - self.zero),
        }
    }

    /// The present yaw counts as zero, as in RCIS.
    fn reset_imu(&mut self, ctx: &mut Context) {
        if let Some(sample) = self.sample(ctx) {
            self.zero = -sample.yaw.to_radians();
        }
    }
}
