//! RoboComp's interface `InnerModelManager` of the simulated world.

use crate::{house, member, start};
use rcis::SpecificWorker;
use rcis_generated::interfaces::inner_model_manager as calls;
use rcis_generated::{
    Context, Coord3D, ErrorType, InnerModelManager, JointType, Lasers, MeshType, Plane3D, Pose3D,
    Simulation, Worker,
};
use std::fmt::Debug;
use std::fs;

/// The code of an exception.
fn code<T: Debug>(call: Result<T, calls::InnerModelManagerErrorOrCall>) -> ErrorType {
    match call {
        Err(calls::InnerModelManagerErrorOrCall::InnerModelManagerError(error)) => error.err,
        other => panic!("{other:?}"),
    }
}

fn at(x: f32, y: f32, z: f32) -> Pose3D {
    Pose3D {
        x,
        y,
        z,
        ..Pose3D::default()
    }
}

fn board(py: f32) -> Plane3D {
    Plane3D {
        py,
        nz: 1.0,
        width: 600.0,
        height: 600.0,
        thickness: 20.0,
        texture: "#ff0000".into(),
        ..Plane3D::default()
    }
}

#[test]
fn bodies_are_not_put_into_each_other_if_that_is_refused() {
    let scene = r#"<innerModel>
        <plane id="wall" pz="1000" nz="1" size="4000,4000,20" collide="1"/>
        <transform id="cup"><sphere id="ball" radius="100" collide="1"/></transform>
        <transform id="below" tz="950"/>
        </innerModel>"#;
    let (mut worker, mut test) = start(scene);
    let put = |worker: &mut SpecificWorker, ctx: &mut Context, z: f32| {
        worker
            .manager()
            .set_pose(ctx, "root".into(), "cup".into(), at(0.0, 0.0, z))
    };
    // Without the parameter, all is possible; what touches may go on to touch.
    let ctx: &mut Context = &mut test;
    assert_eq!(put(&mut worker, ctx, 950.0), Ok(true));
    ctx.params.refuse_collisions = true;
    Worker::params_changed(&mut worker, ctx, &[]).expect("a change");
    assert_eq!(put(&mut worker, ctx, 960.0), Ok(true));
    assert_eq!(put(&mut worker, ctx, 0.0), Ok(true));
    let refused = put(&mut worker, ctx, 950.0);
    let Err(calls::SetPoseError::InnerModelManagerError(error)) = refused else {
        panic!("{refused:?}");
    };
    assert_eq!(error.err, ErrorType::Collision);
    assert_eq!(error.text, "`wall` would collide with `ball`");
    let there = worker.manager().get_pose_from_parent(ctx, "cup".into());
    assert_eq!(there.expect("a pose").1.z, 0.0);
    let moved = worker
        .manager()
        .move_node(ctx, "cup".into(), "below".into());
    assert_eq!(code(moved), ErrorType::Collision);
    assert_eq!(put(&mut worker, ctx, 800.0), Ok(true));
}

const MESH: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";

#[test]
fn changes_are_in_the_next_frame() {
    let (mut worker, mut test) = house();
    let front = member(test.lasers.get("front"));
    let ctx: &mut Context = &mut test;
    let ahead = |worker: &mut SpecificWorker, ctx: &mut Context| {
        // The next frame of a laser of 20 Hz.
        Simulation::step(worker, ctx, String::new(), 5).expect("steps");
        worker.get_laser_data(ctx, &front)[90].dist
    };
    let free = ahead(&mut worker, ctx);
    let stand = || "stand".to_owned();
    let added = worker.manager().add_transform(
        ctx,
        stand(),
        "static".into(),
        "root".into(),
        at(2000.0, 0.0, -700.0),
    );
    assert_eq!(added, Ok(true));
    let added = worker
        .manager()
        .add_plane(ctx, "board".into(), stand(), board(300.0));
    assert_eq!(added, Ok(true));
    assert!((ahead(&mut worker, ctx) - 790.0).abs() < 60.0);
    let moved = worker
        .manager()
        .set_pose(ctx, "root".into(), stand(), at(2000.0, 0.0, -200.0));
    assert_eq!(moved, Ok(true));
    assert!((ahead(&mut worker, ctx) - 1290.0).abs() < 60.0);
    let moved = worker
        .manager()
        .set_pose_from_parent(ctx, stand(), at(2000.0, 0.0, 100.0));
    assert_eq!(moved, Ok(true));
    assert!((ahead(&mut worker, ctx) - 1590.0).abs() < 60.0);
    let (_, there) =
        InnerModelManager::get_pose(&mut worker.manager(), ctx, "root".into(), stand())
            .expect("a pose");
    assert_eq!((there.x, there.z), (2000.0, 100.0));
    let (_, point) = worker
        .manager()
        .transform(ctx, "root".into(), stand(), Coord3D::default())
        .expect("a point");
    assert_eq!((point.x, point.z), (2000.0, 100.0));
    assert_eq!(
        worker
            .manager()
            .set_plane(ctx, "board".into(), board(2000.0)),
        Ok(true)
    );
    // It is above the laser now.
    assert!((ahead(&mut worker, ctx) - free).abs() < 60.0);
    let moved = worker
        .manager()
        .move_node(ctx, "board".into(), "lamp".into());
    assert_eq!(moved, Ok(true));
    let nodes = worker
        .manager()
        .get_all_node_information(ctx)
        .expect("nodes");
    let board = nodes.iter().find(|node| node.id == "board").expect("it");
    assert_eq!(board.parent_id, "lamp");
    assert!(!InnerModelManager::collide(
        &mut worker.manager(),
        ctx,
        "lamp".into(),
        "bed".into()
    ));
    assert_eq!(worker.manager().remove_node(ctx, stand()), Ok(true));
}

#[test]
fn refusals_have_the_codes_of_the_interface() {
    let folder = tempfile::tempdir().expect("a folder");
    let outside = tempfile::tempdir().expect("a folder");
    for folder in [&folder, &outside] {
        fs::write(folder.path().join("chair.obj"), MESH).expect("a file");
    }
    fs::write(folder.path().join("torn.obj"), "f 1 2 3\n").expect("a file");
    let mut test = crate::context(r#"<innerModel><transform id="table"/></innerModel>"#);
    test.params.inner_model = folder.path().join("scene.xml");
    let mut worker =
        <SpecificWorker as rcis_generated::Worker<_>>::initialize(&mut test).expect("a worker");
    let ctx: &mut Context = &mut test;
    let (table, root) = (|| "table".to_owned(), || "root".to_owned());
    let transform = |worker: &mut SpecificWorker, ctx: &mut Context, id: &str, engine: &str| {
        let (id, engine) = (id.to_owned(), engine.to_owned());
        worker
            .manager()
            .add_transform(ctx, id, engine, "root".into(), at(0.0, 0.0, 0.0))
    };
    let again = transform(&mut worker, ctx, "table", "static");
    assert_eq!(code(again), ErrorType::NodeAlreadyExists);
    let engine = transform(&mut worker, ctx, "a", "ode");
    assert_eq!(code(engine), ErrorType::InvalidEngine);
    let joint = JointType {
        axis: "w".into(),
        ..JointType::default()
    };
    let axis = worker.manager().add_joint(ctx, "a".into(), root(), joint);
    assert_eq!(code(axis), ErrorType::InvalidValues);
    let mesh = |path: &str| MeshType {
        mesh_path: path.to_owned(),
        scale_x: 1.0,
        scale_y: 1.0,
        scale_z: 1.0,
        ..MeshType::default()
    };
    let chair = worker
        .manager()
        .add_mesh(ctx, "chair".into(), table(), mesh("chair.obj"));
    assert_eq!(chair, Ok(true));
    let name = outside.path().file_name().and_then(|name| name.to_str());
    let above = format!("../{}/chair.obj", name.expect("a name"));
    let outside = outside.path().join("chair.obj");
    let outside = outside.to_str().expect("a path");
    for path in ["stool.obj", "torn.obj", &above, outside] {
        let refused = worker
            .manager()
            .add_mesh(ctx, "other".into(), table(), mesh(path));
        assert_eq!(code(refused), ErrorType::InvalidPath, "{path}");
        let element = format!(r#"<mesh id="other" file="{path}"/>"#);
        let refused = Simulation::add(&mut worker, ctx, String::new(), table(), element);
        assert!(refused.is_err(), "{path}");
    }
    let scaled = worker
        .manager()
        .set_scale(ctx, "chair".into(), 2.0, 2.0, 2.0);
    assert_eq!(scaled, Ok(true));
    let kind = worker.manager().set_scale(ctx, table(), 2.0, 2.0, 2.0);
    assert_eq!(code(kind), ErrorType::OperationInvalidNode);
    let unknown = worker
        .manager()
        .set_plane(ctx, "nowhere".into(), board(0.0));
    assert_eq!(code(unknown), ErrorType::NonExistingNode);
    let unknown = worker.manager().remove_node(ctx, "nowhere".into());
    assert_eq!(code(unknown), ErrorType::NonExistingNode);
    let circle = worker.manager().move_node(ctx, root(), table());
    assert_eq!(code(circle), ErrorType::OperationInvalidNode);
    let name = || "colour".to_owned();
    let text = || "string".to_owned();
    let missing = worker.manager().get_attribute(ctx, table(), name());
    assert_eq!(code(missing), ErrorType::NonExistingAttribute);
    let added = InnerModelManager::add_attribute(
        &mut worker.manager(),
        ctx,
        table(),
        name(),
        text(),
        "red".into(),
    );
    assert_eq!(added, Ok(true));
    let again = InnerModelManager::add_attribute(
        &mut worker.manager(),
        ctx,
        table(),
        name(),
        text(),
        "red".into(),
    );
    assert_eq!(code(again), ErrorType::AttributeAlreadyExists);
    let set = InnerModelManager::set_attribute(
        &mut worker.manager(),
        ctx,
        table(),
        name(),
        text(),
        "blue".into(),
    );
    assert_eq!(set, Ok(true));
    let found = worker.manager().get_attribute(ctx, table(), name());
    assert_eq!(found, Ok((true, text(), "blue".to_owned())));
    assert_eq!(
        InnerModelManager::remove_attribute(&mut worker.manager(), ctx, table(), name()),
        Ok(true)
    );
    let matrix = worker
        .manager()
        .get_transformation_matrix(ctx, root(), table());
    assert_eq!(matrix.expect("a matrix").data.len(), 16);
    let (_, pose) = worker
        .manager()
        .get_pose_from_parent(ctx, table())
        .expect("a pose");
    assert_eq!(pose, at(0.0, 0.0, 0.0));
    // No sensor sees points: this is logged, and changes nothing.
    worker
        .manager()
        .set_point_cloud_data(ctx, table(), Vec::new());
}

/// With these, every code of the interface is reached.
#[test]
fn results_that_no_float_holds_are_internal_errors() {
    let mut test = crate::context("<innerModel/>");
    let mut worker =
        <SpecificWorker as rcis_generated::Worker<_>>::initialize(&mut test).expect("a worker");
    let ctx: &mut Context = &mut test;
    for (item, base) in [("far", "root"), ("farther", "far")] {
        let pose = at(3e38, 0.0, 0.0);
        let added =
            worker
                .manager()
                .add_transform(ctx, item.into(), "static".into(), base.into(), pose);
        assert_eq!(added, Ok(true));
    }
    let (root, farther) = (|| "root".to_owned(), || "farther".to_owned());
    let pose = InnerModelManager::get_pose(&mut worker.manager(), ctx, root(), farther());
    assert_eq!(code(pose), ErrorType::InternalError);
    let point = worker
        .manager()
        .transform(ctx, root(), farther(), Coord3D::default());
    assert_eq!(code(point), ErrorType::InternalError);
    let matrix = worker
        .manager()
        .get_transformation_matrix(ctx, root(), farther());
    assert_eq!(code(matrix), ErrorType::InternalError);
}
