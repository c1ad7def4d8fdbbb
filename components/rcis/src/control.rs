//! The interface `Simulation`.

use crate::SpecificWorker;
use crate::drawing::drawing;
use crate::elements::MOST_NODES;
use crate::pictures::id_image;
use crate::predictions::Motion;
use crate::refusal::{Refusal, reply};
use crate::requests::{clock, one_element, pose_in, pose_out, speed, wrong};
use crate::steps::in_clone;
use innermodel_physics::Physics;
use innermodel_simulation::{Dynamics, MotorGoal, Speed};
use rcis_generated::interfaces::simulation as calls;
use rcis_generated::types::rc_simulation::Reason;
use rcis_generated::{
    Attribute, BodyJoint, Clock, Collision, Context, Direction, Followed, IdImage, Names, Nodes,
    Png, Point, Pose, Prediction, Signal, Simulation, Skeleton, Viewpoint,
};
use std::time::Duration;

/// The longest prediction in seconds.
const LONGEST: f64 = 3600.0;

/// The number of worlds that the parameters allow.
fn most(ctx: &Context) -> usize {
    usize::try_from(ctx.params.most_worlds).unwrap_or(0)
}

impl Simulation<Context> for SpecificWorker {
    fn get_clock(
        &mut self,
        _ctx: &mut Context,
        world: String,
    ) -> Result<Clock, calls::GetClockError> {
        let pending = if world.is_empty() {
            self.steps.pending()
        } else {
            0
        };
        self.worlds.with(&world, |world| Ok(clock(world, pending)))
    }

    fn step(
        &mut self,
        ctx: &mut Context,
        world: String,
        count: i64,
    ) -> Result<Clock, calls::StepError> {
        if world.is_empty() {
            return reply(self.steps.on_request(ctx, &mut self.worlds.main, count));
        }
        let clone = self.worlds.named(&world);
        reply(clone.and_then(|clone| in_clone(clone, count, ctx.params.work)))
    }

    fn set_paused(&mut self, _ctx: &mut Context, paused: bool) {
        self.steps.paused = paused;
    }

    fn add(
        &mut self,
        _ctx: &mut Context,
        world: String,
        parent: String,
        element: String,
    ) -> Result<(), calls::AddError> {
        let document = one_element(&self.scene, &element);
        self.worlds.with(&world, |world| {
            let document = document?;
            if world.tree().len() + document.nodes.len() > MOST_NODES {
                let text = format!("a world has at most {MOST_NODES} nodes");
                return Err(Refusal::Other(Reason::TooMany, text));
            }
            world.edit(|edit| edit.add_document(&parent, &document))?;
            Ok(())
        })
    }

    fn remove(
        &mut self,
        _ctx: &mut Context,
        world: String,
        id: String,
    ) -> Result<(), calls::RemoveError> {
        self.worlds.with(&world, |world| {
            world.edit(|edit| edit.remove(&id))?;
            Ok(())
        })
    }

    fn set(
        &mut self,
        _ctx: &mut Context,
        world: String,
        id: String,
        element: String,
    ) -> Result<(), calls::SetError> {
        let document = one_element(&self.scene, &element);
        self.worlds
            .with(&world, |world| match &document?.nodes[..] {
                [node] if node.id == id => {
                    let (kind, allowed) = (node.kind.clone(), node.allowed.clone());
                    world.edit(|edit| {
                        edit.set_kind(&id, kind)?;
                        edit.set_allowed(&id, allowed)
                    })?;
                    Ok(())
                }
                _ => {
                    let text = "expected one element with the id of the node, and none in it";
                    Err(Refusal::Other(Reason::WrongText, text.to_owned()))
                }
            })
    }

    fn teleport(
        &mut self,
        _ctx: &mut Context,
        world: String,
        id: String,
        base: String,
        pose: Pose,
    ) -> Result<(), calls::TeleportError> {
        self.worlds.with(&world, |world| {
            Ok(world.teleport(&id, &base, pose_in(&pose))?)
        })
    }

    fn move_to(
        &mut self,
        _ctx: &mut Context,
        world: String,
        id: String,
        parent: String,
    ) -> Result<(), calls::MoveToError> {
        self.worlds.with(&world, |world| {
            Ok(world.edit(|edit| edit.move_to(&id, &parent))?)
        })
    }

    fn re_parent(
        &mut self,
        _ctx: &mut Context,
        world: String,
        id: String,
        parent: String,
    ) -> Result<(), calls::ReParentError> {
        self.worlds.with(&world, |world| {
            Ok(world.edit(|edit| edit.re_parent(&id, &parent))?)
        })
    }

    fn set_attribute(
        &mut self,
        _ctx: &mut Context,
        world: String,
        id: String,
        attribute: Attribute,
    ) -> Result<(), calls::SetAttributeError> {
        let Attribute { name, type_, value } = attribute;
        self.worlds.with(&world, |world| {
            Ok(world.edit(|edit| {
                let known = edit.snapshot().node(&id)?.attribute(&name).is_ok();
                if known {
                    edit.set_attribute(&id, &name, &type_, &value)
                } else {
                    edit.add_attribute(&id, &name, &type_, &value)
                }
            })?)
        })
    }

    fn remove_attribute(
        &mut self,
        _ctx: &mut Context,
        world: String,
        id: String,
        name: String,
    ) -> Result<(), calls::RemoveAttributeError> {
        self.worlds.with(&world, |world| {
            Ok(world.edit(|edit| edit.remove_attribute(&id, &name))?)
        })
    }

    fn follow(
        &mut self,
        _ctx: &mut Context,
        whole: bool,
        removed: Names,
        nodes: Nodes,
    ) -> Followed {
        let world = &mut self.worlds.main;
        self.following
            .follow(world, &self.scene, (whole, removed, nodes))
    }

    fn set_signal(
        &mut self,
        _ctx: &mut Context,
        world: String,
        id: String,
        signal: Signal,
    ) -> Result<(), calls::SetSignalError> {
        self.worlds.with(&world, |world| {
            let new = innermodel::kinds::Signal {
                rate: signal.rate,
                noise: signal.noise,
                quantum: signal.quantum,
                dropout: signal.dropout,
                drift: signal.drift,
                latency: signal.latency,
            };
            Ok(world.set_signal(&id, new)?)
        })
    }

    fn get_signal(
        &mut self,
        _ctx: &mut Context,
        world: String,
        id: String,
    ) -> Result<Signal, calls::GetSignalError> {
        self.worlds.with(&world, |world| {
            let signal = world.signal(&id)?;
            Ok(Signal {
                rate: signal.rate,
                noise: signal.noise,
                quantum: signal.quantum,
                dropout: signal.dropout,
                drift: signal.drift,
                latency: signal.latency,
            })
        })
    }

    fn collide(
        &mut self,
        _ctx: &mut Context,
        world: String,
        a: String,
        b: String,
    ) -> Result<bool, calls::CollideError> {
        self.worlds.with(&world, |world| Ok(world.collide(&a, &b)?))
    }

    fn get_pose(
        &mut self,
        _ctx: &mut Context,
        world: String,
        id: String,
        base: String,
    ) -> Result<Pose, calls::GetPoseError> {
        self.worlds.with(&world, |world| {
            Ok(pose_out(&world.tree().pose(&base, &id)?))
        })
    }

    fn print(&mut self, _ctx: &mut Context, world: String) -> Result<String, calls::PrintError> {
        self.worlds.with(&world, |world| Ok(world.tree().print()))
    }

    fn draw(
        &mut self,
        _ctx: &mut Context,
        world: String,
        view: Viewpoint,
    ) -> Result<Png, calls::DrawError> {
        reply(drawing(&mut self.worlds, &world, &view))
    }

    fn get_digest(
        &mut self,
        _ctx: &mut Context,
        world: String,
    ) -> Result<i64, calls::GetDigestError> {
        self.worlds
            .with(&world, |world| Ok(world.digest().cast_signed()))
    }

    fn get_skeleton(
        &mut self,
        _ctx: &mut Context,
        world: String,
        id: String,
    ) -> Result<Skeleton, calls::GetSkeletonError> {
        self.worlds.with(&world, |world| {
            let joints = world.skeleton(&id)?.into_iter();
            Ok(joints
                .map(|(name, place)| BodyJoint {
                    name: name.to_owned(),
                    place: Point {
                        x: place.x,
                        y: place.y,
                        z: place.z,
                    },
                })
                .collect())
        })
    }

    fn get_id_image(
        &mut self,
        _ctx: &mut Context,
        world: String,
        camera: String,
    ) -> Result<IdImage, calls::GetIdImageError> {
        self.worlds
            .with(&world, |world| Ok(id_image(&*world.picture(&camera)?)))
    }

    fn set_physics(
        &mut self,
        _ctx: &mut Context,
        world: String,
        active: bool,
    ) -> Result<(), calls::SetPhysicsError> {
        self.worlds.with(&world, |world| {
            if active != world.has_dynamics() {
                let physics: Box<dyn Dynamics> = Box::new(Physics::new());
                world.set_dynamics(active.then_some(physics));
            }
            Ok(())
        })
    }

    fn push(
        &mut self,
        _ctx: &mut Context,
        world: String,
        id: String,
        impulse: Direction,
    ) -> Result<(), calls::PushError> {
        let impulse = innermodel::Vector::new(impulse.x, impulse.y, impulse.z);
        self.worlds
            .with(&world, |world| Ok(world.push(&id, impulse)?))
    }

    fn release(
        &mut self,
        _ctx: &mut Context,
        world: String,
        joint: String,
    ) -> Result<(), calls::ReleaseError> {
        self.worlds.with(&world, |world| {
            world.command(&[(&joint, MotorGoal::Free)])?;
            Ok(())
        })
    }

    fn snapshot(
        &mut self,
        ctx: &mut Context,
        world: String,
        name: String,
    ) -> Result<(), calls::SnapshotError> {
        reply(self.worlds.keep(&world, name, most(ctx)))
    }

    fn restore(
        &mut self,
        _ctx: &mut Context,
        world: String,
        name: String,
    ) -> Result<(), calls::RestoreError> {
        reply(self.worlds.restore(&world, &name))
    }

    fn forget_snapshot(
        &mut self,
        _ctx: &mut Context,
        name: String,
    ) -> Result<(), calls::ForgetSnapshotError> {
        reply(self.worlds.forget(&name))
    }

    fn get_snapshots(&mut self, _ctx: &mut Context) -> Names {
        self.worlds.snapshots()
    }

    fn predict(
        &mut self,
        ctx: &mut Context,
        world: String,
        base: String,
        side: f64,
        advance: f64,
        turn: f64,
        time: f64,
    ) -> Result<Prediction, calls::PredictError> {
        if !(0.0..=LONGEST).contains(&time) {
            let text = format!("expected 0 to {LONGEST} seconds, found {time}");
            return reply(Err(wrong(text)));
        }
        let found = self.predictions.predict(
            &mut self.worlds,
            ctx.params.work,
            Motion {
                world,
                base,
                speed: speed(side, advance, turn),
                time: Duration::from_secs_f64(time),
            },
        );
        reply(found.map(|found| Prediction {
            pose: pose_out(&found.pose),
            collision: found.collision.map(|collision| Collision {
                after: collision.after.as_secs_f64(),
                body: collision.body,
                obstacle: collision.obstacle,
            }),
        }))
    }

    fn clone(
        &mut self,
        ctx: &mut Context,
        world: String,
        name: String,
    ) -> Result<(), calls::CloneError> {
        reply(self.worlds.add_clone(&world, name, most(ctx)))
    }

    fn remove_clone(
        &mut self,
        _ctx: &mut Context,
        name: String,
    ) -> Result<(), calls::RemoveCloneError> {
        reply(self.worlds.remove_clone(&name))
    }

    fn get_clones(&mut self, _ctx: &mut Context) -> Names {
        self.worlds.clones()
    }

    fn drive(
        &mut self,
        _ctx: &mut Context,
        world: String,
        base: String,
        side: f64,
        advance: f64,
        turn: f64,
    ) -> Result<f64, calls::DriveError> {
        self.worlds.with(&world, |world| {
            let taken = world.drive(&base, speed(side, advance, turn))?;
            // A motion that a base of this kind cannot make limits nothing.
            let parts = [
                (taken.side, side),
                (taken.advance, advance),
                (taken.turn, turn),
            ];
            let parts = parts
                .into_iter()
                .filter(|(taken, asked)| *asked != 0.0 && *taken != 0.0);
            let least = parts.map(|(taken, asked)| taken / asked).reduce(f64::min);
            let stands = speed(side, advance, turn) == Speed::default();
            Ok(least.unwrap_or(if stands { 1.0 } else { 0.0 }))
        })
    }
}
