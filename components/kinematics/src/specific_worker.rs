//! Keeps the positions of joints, publishes where the links are, and writes it into the world.

use crate::answers::Answers;
use crate::robot;
use crate::world::World;
use kinematics_generated::interfaces::world::ReceiveWorld;
use kinematics_generated::interfaces::world_stream::ReceiveWorldStream;
use kinematics_generated::tracing::{info, warn};
use kinematics_generated::{
    Context, HandlerError, Header, JointState, Joints, Quaternion, Time, Transform,
    TransformStamped, Vector3, Worker, WorkerError,
};
use rc_middleware::Reader;
use rc_robot::State;
use rc_world_member::Interface;

/// A link, and the one above it.
pub(crate) struct Frame {
    pub(crate) link: usize,
    pub(crate) above: usize,
}

/// The robot, and where its joints are.
pub struct SpecificWorker {
    pub(crate) answers: Answers,
    /// The positions of all joints: 0, or the nearest limit, until the first message.
    pub(crate) now: Vec<f64>,
    frames: Vec<Frame>,
    /// Whether a message was refused, so that it is said once.
    is_refused: bool,
    /// The world of the network, if it has one.
    world: Option<World>,
}

/// A transform in metres.
pub(crate) fn transform(of: &rc_quantity::Transform) -> Transform {
    let [x, y, z] = of.translation;
    let translation = Vector3 { x, y, z };
    let [x, y, z, w] = rc_quantity::rotation::Quaternion::of_matrix(&of.rotation).to_xyzw();
    Transform {
        translation,
        rotation: Quaternion { x, y, z, w },
    }
}

impl Worker<Context> for SpecificWorker {
    fn initialize(ctx: &mut Context) -> Result<Self, WorkerError> {
        let cell = robot::read(&ctx.params.robot).map_err(WorkerError::Fatal)?;
        let robot = &cell.robot;
        let limits = robot.limits().into_iter();
        let now = limits.map(|limits| limits.map_or(0.0, |l| 0.0_f64.clamp(l.lower, l.upper)));
        let now: Vec<f64> = now.collect();
        let above = |mut body: usize| loop {
            body = robot.bodies[body].joint.as_ref()?.parent;
            // Bodies inside a joint of several coordinates are no links.
            if !robot.bodies[body].name.is_empty() {
                return Some(body);
            }
        };
        let links = robot.links();
        let frames = links.filter_map(|(link, _)| {
            Some(Frame {
                link,
                above: above(link)?,
            })
        });
        let frames = frames.collect();
        let world = World::open(ctx, robot, &now).map_err(WorkerError::Fatal)?;
        info!(
            "{}: {} joints",
            ctx.params.robot.display(),
            robot.coordinates.len()
        );
        Ok(Self {
            answers: Answers::new(cell),
            now,
            frames,
            is_refused: false,
            world,
        })
    }

    fn compute(&mut self, ctx: &mut Context) -> Result<(), WorkerError> {
        self.turn(ctx);
        Ok(())
    }

    fn finalize(&mut self, ctx: &mut Context) {
        if let Some(world) = &mut self.world {
            world.leave(ctx);
        }
    }
}

impl ReceiveWorld<Context> for SpecificWorker {
    fn receive(
        &mut self,
        ctx: &mut Context,
        topic: usize,
        reader: &mut Reader<'_>,
    ) -> Result<(), HandlerError> {
        self.hear(ctx, Interface::World, topic, reader)
    }
}

impl ReceiveWorldStream<Context> for SpecificWorker {
    fn receive(
        &mut self,
        ctx: &mut Context,
        topic: usize,
        reader: &mut Reader<'_>,
    ) -> Result<(), HandlerError> {
        self.hear(ctx, Interface::WorldStream, topic, reader)
    }
}

impl Joints<Context> for SpecificWorker {
    fn joint_states(&mut self, ctx: &mut Context, state: JointState) {
        let JointState {
            name,
            position,
            header,
            ..
        } = state;
        let is_good = name.len() == position.len() && position.iter().all(|at| at.is_finite());
        if !is_good {
            if !self.is_refused {
                warn!(
                    "a message has {} names and {} positions, or one that is not finite",
                    name.len(),
                    position.len()
                );
            }
            self.is_refused = true;
            return;
        }
        self.is_refused = false;
        // Joints of other robots may be on the topic, too.
        let known = &self.answers.cell.robot.coordinates;
        for (joint, position) in name.iter().zip(position) {
            if let Some(at) = known.iter().position(|known| known == joint) {
                self.now[at] = position;
            }
        }
        if ctx.params.publish_frames {
            self.publish(ctx, &header.stamp);
        }
        if let Some(world) = &mut self.world {
            world.tell(&self.now);
        }
        self.turn(ctx);
    }
}

impl SpecificWorker {
    fn turn(&mut self, ctx: &mut Context) {
        if let Some(world) = &mut self.world {
            world.turn(ctx, &self.frames);
        }
    }

    fn hear(
        &mut self,
        ctx: &mut Context,
        of: Interface,
        topic: usize,
        reader: &mut Reader<'_>,
    ) -> Result<(), HandlerError> {
        // Without a world, nobody listens.
        let Some(world) = &mut self.world else {
            return Ok(());
        };
        world.receive(of, topic, reader)?;
        self.turn(ctx);
        Ok(())
    }

    /// Publishes each link in the one above it.
    fn publish(&self, ctx: &mut Context, stamp: &Time) {
        let robot = &self.answers.cell.robot;
        let state = State::still(self.now.clone());
        let frames = self.frames.iter().filter_map(|frame| {
            let chain = robot.chain(frame.above, frame.link)?;
            Some(TransformStamped {
                header: Header {
                    stamp: stamp.clone(),
                    frame_id: robot.bodies[frame.above].name.clone(),
                },
                child_frame_id: robot.bodies[frame.link].name.clone(),
                transform: transform(&chain.moved(&state).pose),
            })
        });
        let frames: Vec<TransformStamped> = frames.collect();
        if let Err(error) = ctx.frames.transforms(&frames) {
            warn!("frames are not published: {error}");
        }
    }
}
