//! The interface `Simulation`.

use crate::SpecificWorker;
use crate::elements::MOST_NODES;
use crate::pictures::id_image;
use crate::predictions::Motion;
use crate::refusal::{Refusal, reply};
use crate::requests::{clock, one_element, pose_in, pose_out, speed, wrong};
use crate::worlds::{check_new, unknown};
use innermodel_physics::Physics;
use innermodel_simulation::{Dynamics, MotorGoal, Speed, World};
use rcis_generated::interfaces::simulation as calls;
use rcis_generated::types::rc_simulation::Reason;
use rcis_generated::{
    Attribute, BodyJoint, Clock, Collision, Context, Direction, IdImage, Names, Png, Point, Pose,
    Prediction, Signal, Simulation, Skeleton, Viewpoint,
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
        let pending = if world.is_empty() { self.pending } else { 0 };
        self.with(&world, |world| Ok(clock(world, pending)))
    }

    fn step(
        &mut self,
        ctx: &mut Context,
        world: String,
        count: i64,
    ) -> Result<Clock, calls::StepError> {
        reply(self.make_steps(ctx, &world, count))
    }

    fn set_paused(&mut self, _ctx: &mut Context, paused: bool) {
        self.paused = paused;
    }

    fn add(
        &mut self,
        _ctx: &mut Context,
        world: String,
        parent: String,
        element: String,
    ) -> Result<(), calls::AddError> {
        let document = one_element(&self.scene, &element);
        self.with(&world, |world| {
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
        self.with(&world, |world| {
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
        self.with(&world, |world| match &document?.nodes[..] {
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
        self.with(&world, |world| {
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
        self.with(&world, |world| {
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
        self.with(&world, |world| {
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
        self.with(&world, |world| {
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
        self.with(&world, |world| {
            Ok(world.edit(|edit| edit.remove_attribute(&id, &name))?)
        })
    }

    fn set_signal(
        &mut self,
        _ctx: &mut Context,
        world: String,
        id: String,
        signal: Signal,
    ) -> Result<(), calls::SetSignalError> {
        self.with(&world, |world| {
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
        self.with(&world, |world| {
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
        self.with(&world, |world| Ok(world.collide(&a, &b)?))
    }

    fn get_pose(
        &mut self,
        _ctx: &mut Context,
        world: String,
        id: String,
        base: String,
    ) -> Result<Pose, calls::GetPoseError> {
        self.with(&world, |world| {
            Ok(pose_out(&world.tree().pose(&base, &id)?))
        })
    }

    fn print(&mut self, _ctx: &mut Context, world: String) -> Result<String, calls::PrintError> {
        self.with(&world, |world| Ok(world.tree().print()))
    }

    fn draw(
        &mut self,
        _ctx: &mut Context,
        world: String,
        view: Viewpoint,
    ) -> Result<Png, calls::DrawError> {
        reply(self.drawing(&world, &view))
    }

    fn get_digest(
        &mut self,
        _ctx: &mut Context,
        world: String,
    ) -> Result<i64, calls::GetDigestError> {
        self.with(&world, |world| Ok(world.digest().cast_signed()))
    }

    fn get_skeleton(
        &mut self,
        _ctx: &mut Context,
        world: String,
        id: String,
    ) -> Result<Skeleton, calls::GetSkeletonError> {
        self.with(&world, |world| {
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
        self.with(&world, |world| Ok(id_image(&*world.picture(&camera)?)))
    }

    fn set_physics(
        &mut self,
        _ctx: &mut Context,
        world: String,
        active: bool,
    ) -> Result<(), calls::SetPhysicsError> {
        self.with(&world, |world| {
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
        self.with(&world, |world| Ok(world.push(&id, impulse)?))
    }

    fn release(
        &mut self,
        _ctx: &mut Context,
        world: String,
        joint: String,
    ) -> Result<(), calls::ReleaseError> {
        self.with(&world, |world| {
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
        let free = check_new(&self.worlds.snapshots, &name, "snapshot", most(ctx));
        let kept = free.and_then(|()| Ok(self.named(&world)?.snapshot()));
        reply(kept.map(|kept| drop(self.worlds.snapshots.insert(name, kept))))
    }

    fn restore(
        &mut self,
        _ctx: &mut Context,
        world: String,
        name: String,
    ) -> Result<(), calls::RestoreError> {
        let kept = self.worlds.snapshots.get(&name).cloned();
        let kept = kept.ok_or_else(|| unknown(&self.worlds.snapshots, &name, "snapshot"));
        reply(kept.and_then(|kept| {
            self.named(&world)?.restore(&kept);
            Ok(())
        }))
    }

    fn forget_snapshot(
        &mut self,
        _ctx: &mut Context,
        name: String,
    ) -> Result<(), calls::ForgetSnapshotError> {
        let known = self.worlds.snapshots.remove(&name);
        let known = known.ok_or_else(|| unknown(&self.worlds.snapshots, &name, "snapshot"));
        reply(known.map(drop))
    }

    fn get_snapshots(&mut self, _ctx: &mut Context) -> Names {
        self.worlds.snapshots.keys().cloned().collect()
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
        let found = self.prediction(
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
        let free = check_new(&self.worlds.clones, &name, "clone", most(ctx));
        let new = free.and_then(|()| Ok(World::clone(self.named(&world)?)));
        reply(new.map(|new| drop(self.worlds.clones.insert(name, new))))
    }

    fn remove_clone(
        &mut self,
        _ctx: &mut Context,
        name: String,
    ) -> Result<(), calls::RemoveCloneError> {
        let known = self.worlds.clones.remove(&name);
        let known = known.ok_or_else(|| unknown(&self.worlds.clones, &name, "clone"));
        reply(known.map(drop))
    }

    fn get_clones(&mut self, _ctx: &mut Context) -> Names {
        self.worlds.clones.keys().cloned().collect()
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
        self.with(&world, |world| {
            let taken = world.drive(&base, speed(side, advance, turn))?;
            // What a base of this kind does not do limits nothing.
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
