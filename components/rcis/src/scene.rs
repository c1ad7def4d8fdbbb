//! Which slots a scene has.

use innermodel::slots::{self, Members};
use innermodel_simulation::World;
use rcis_generated::{Context, WorkerError};

/// Opens the members that `rcview --slots` prints for the scene: one for each device, in each array
/// of its kind.
pub(crate) fn open(ctx: &mut Context, world: &World) -> Result<(), WorkerError> {
    for Members { array, members, .. } in slots::of(&world.tree()) {
        for name in &members {
            open_member(ctx, array, name)?;
        }
    }
    Ok(())
}

fn open_member(ctx: &mut Context, array: &str, name: &str) -> Result<(), WorkerError> {
    let opened = match array {
        "lasers" => ctx.lasers.open(name),
        "lidars" => ctx.lidars.open(name),
        "ultrasounds" => ctx.ultrasounds.open(name),
        "touch_sensors" => ctx.touch_sensors.open(name),
        "bumpers" => ctx.bumpers.open(name),
        "cameras" => ctx.cameras.open(name),
        "simple_cameras" => ctx.simple_cameras.open(name),
        "rgbd_cameras" => ctx.rgbd_cameras.open(name),
        "rgbds" => ctx.rgbds.open(name),
        "imus" => ctx.imus.open(name),
        "poses" => ctx.poses.open(name),
        "batteries" => ctx.batteries.open(name),
        "bases" => ctx.bases.open(name),
        "omni_bases" => ctx.omni_bases.open(name),
        "generic_bases" => ctx.generic_bases.open(name),
        "motors" => ctx.motors.open(name),
        "pose_topics" => ctx.pose_topics.open(name),
        other => {
            let reason = format!("rcis.cdsl has no slot array `{other}`");
            return Err(WorkerError::Fatal(reason));
        }
    };
    opened?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use innermodel::InnerModel;
    use rcis_generated::Worker;
    use rcis_generated::testing::TestContext;
    use std::sync::Arc;

    /// One device of each kind.
    const SCENE: &str = r#"<innerModel>
        <differentialrobot id="robot">
            <laser id="front"/><lidar id="roof"/><ultrasound id="sonar"/><touchsensor id="skirt"/>
            <camera id="eye" width="64" height="48" focal="50"/><imu id="imu"/><battery id="battery"/>
        </differentialrobot>
        <omnirobot id="omni"><rgbd id="depth" width="64" height="48" focal="50"/></omnirobot>
        <transform id="arm"><joint id="elbow" axis="x"><prismaticJoint id="wrist" axis="x"/></joint></transform>
    </innerModel>"#;

    #[test]
    fn every_array_of_every_kind_is_opened() -> Result<(), Box<dyn std::error::Error>> {
        let mut test = TestContext::configured()?;
        let scene = InnerModel::parse(SCENE)?;
        let expected = slots::of(&scene.snapshot());
        assert_eq!(expected.len(), 17, "{expected:?}");
        test.tree = Arc::new(scene);
        crate::SpecificWorker::initialize(&mut test).map_err(|error| error.to_string())?;
        let ctx: &Context = &test;
        let opened = [
            ctx.lasers.members(),
            ctx.lidars.members(),
            ctx.ultrasounds.members(),
            ctx.touch_sensors.members(),
            ctx.bumpers.members(),
            ctx.cameras.members(),
            ctx.simple_cameras.members(),
            ctx.rgbd_cameras.members(),
            ctx.rgbds.members(),
            ctx.imus.members(),
            ctx.poses.members(),
            ctx.batteries.members(),
            ctx.bases.members(),
            ctx.omni_bases.members(),
            ctx.generic_bases.members(),
            ctx.motors.members(),
            ctx.pose_topics.members(),
        ];
        for (opened, Members { array, members, .. }) in opened.iter().zip(&expected) {
            let opened: Vec<&str> = opened.iter().map(|member| member.name()).collect();
            assert_eq!(opened, *members, "{array}");
        }
        Ok(())
    }
}
