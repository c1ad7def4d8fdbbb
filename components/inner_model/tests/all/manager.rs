//! RoboComp's interface: all operations, and each code of an error.

use crate::start;
use inner_model_generated::interfaces::inner_model_manager as calls;
use inner_model_generated::{
    Colored3DPoint, Context, Coord3D, ErrorType, InnerModel, InnerModelManager, JointType,
    MeshType, NodeType, Plane3D, Pose3D,
};
use std::fmt::Debug;

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

fn joint(axis: &str, min: f32, max: f32) -> JointType {
    JointType {
        pose: at(0.0, 10.0, 0.0),
        axis: axis.into(),
        min,
        max,
        ..JointType::default()
    }
}

fn mesh(path: &str, scale: f32) -> MeshType {
    MeshType {
        scale_x: scale,
        scale_y: scale,
        scale_z: scale,
        mesh_path: path.into(),
        ..MeshType::default()
    }
}

#[test]
fn nodes_are_added_listed_and_removed() {
    let (mut worker, mut test) = start("robot.xml");
    let ctx: &mut Context = &mut test;
    let it: &mut dyn InnerModelManager<Context> = &mut worker.manager(ctx);
    let add =
        |it: &mut dyn InnerModelManager<Context>, ctx: &mut Context, item: &str, engine: &str| {
            it.add_transform(
                ctx,
                item.into(),
                engine.into(),
                "root".into(),
                at(100.0, 0.0, 0.0),
            )
        };
    assert_eq!(add(it, ctx, "stand", "static"), Ok(true));
    let again = add(it, ctx, "stand", "bullet");
    assert_eq!(code(again), ErrorType::NodeAlreadyExists);
    let wrong = add(it, ctx, "other", "ode");
    assert_eq!(code(wrong), ErrorType::InvalidEngine);
    let empty = add(it, ctx, "", "static");
    assert_eq!(code(empty), ErrorType::InvalidValues);
    let control = add(it, ctx, "a\u{1}", "static");
    assert_eq!(code(control), ErrorType::InvalidValues);

    let mut add = |item: &str, joint: JointType, ctx: &mut Context| {
        it.add_joint(ctx, item.into(), "stand".into(), joint)
    };
    assert_eq!(add("turn", joint("", -1.0, 1.0), ctx), Ok(true));
    for wrong in [
        joint("w", 0.0, 1.0),
        joint("x", 1.0, 0.0),
        joint("x", f32::NAN, 0.0),
        joint("x", f32::INFINITY, f32::INFINITY),
        joint("x", f32::NEG_INFINITY, f32::NEG_INFINITY),
    ] {
        let refused = add("other", wrong, ctx);
        assert_eq!(code(refused), ErrorType::InvalidValues);
    }

    let mut add = |item: &str, base: &str, mesh: MeshType, ctx: &mut Context| {
        it.add_mesh(ctx, item.into(), base.into(), mesh)
    };
    assert_eq!(add("pole", "turn", mesh("mast.obj", 2.0), ctx), Ok(true));
    let missing = add("other", "turn", mesh("none.obj", 1.0), ctx);
    assert_eq!(code(missing), ErrorType::InvalidPath);
    let wrong = add("other", "turn", mesh("robot.xml", 1.0), ctx);
    assert_eq!(code(wrong), ErrorType::InvalidPath);
    let no_text = add("other", "turn", mesh("\u{1}.obj", 1.0), ctx);
    assert_eq!(code(no_text), ErrorType::InvalidPath);
    let negative = add("other", "turn", mesh("mast.obj", -1.0), ctx);
    assert_eq!(code(negative), ErrorType::InvalidValues);
    let below = add("other", "pole", mesh("mast.obj", 1.0), ctx);
    assert_eq!(code(below), ErrorType::OperationInvalidNode);

    let plane = Plane3D {
        width: 100.0,
        height: 50.0,
        thickness: 10.0,
        texture: "#ff0000".into(),
        ..Plane3D::default()
    };
    let nowhere = it.add_plane(ctx, "sign".into(), "nowhere".into(), plane.clone());
    assert_eq!(code(nowhere), ErrorType::NonExistingNode);
    assert_eq!(
        it.add_plane(ctx, "sign".into(), "turn".into(), plane),
        Ok(true)
    );

    let nodes = it.get_all_node_information(ctx).expect("all nodes");
    let of = |id: &str| nodes.iter().find(|node| node.id == id).expect("a node");
    assert_eq!(
        (of("root").parent_id.as_str(), of("root").n_type),
        ("", NodeType::Transform)
    );
    for (id, parent, kind) in [
        ("stand", "root", NodeType::Transform),
        ("turn", "stand", NodeType::Joint),
        ("pole", "turn", NodeType::Mesh),
        ("sign", "turn", NodeType::Plane),
        ("robot", "root", NodeType::DifferentialRobot),
        ("laser", "laser_pose", NodeType::Laser),
        ("camera", "eye", NodeType::Rgbd),
        ("imu", "robot", NodeType::Imu),
        ("bumper", "robot", NodeType::TouchSensor),
    ] {
        assert_eq!(
            (of(id).parent_id.as_str(), of(id).n_type),
            (parent, kind),
            "{id}"
        );
    }

    assert_eq!(it.move_node(ctx, "turn".into(), "robot".into()), Ok(true));
    let circle = it.move_node(ctx, "robot".into(), "turn".into());
    assert_eq!(code(circle), ErrorType::OperationInvalidNode);
    assert_eq!(it.remove_node(ctx, "turn".into()), Ok(true));
    let gone = it.remove_node(ctx, "pole".into());
    assert_eq!(code(gone), ErrorType::NonExistingNode);
    let root = it.remove_node(ctx, "root".into());
    assert_eq!(code(root), ErrorType::OperationInvalidNode);
}

#[test]
fn poses_planes_and_scales() {
    let (mut worker, mut test) = start("arm.xml");
    let ctx: &mut Context = &mut test;
    let it: &mut dyn InnerModelManager<Context> = &mut worker.manager(ctx);
    assert_eq!(
        it.set_pose(ctx, "root".into(), "cup".into(), at(1.0, 2.0, 3.0)),
        Ok(true)
    );
    let (done, pose) = it
        .get_pose(ctx, "root".into(), "cup".into())
        .expect("a pose");
    assert!(done && (pose.x - 1.0).abs() < 1e-4 && (pose.y - 2.0).abs() < 1e-4);
    let (_, pose) = it.get_pose_from_parent(ctx, "cup".into()).expect("a pose");
    assert!((pose.y + 698.0).abs() < 1e-3);
    assert_eq!(
        it.set_pose_from_parent(ctx, "cup".into(), at(300.0, 0.0, 100.0)),
        Ok(true)
    );
    let infinite = it.set_pose_from_parent(ctx, "cup".into(), at(f32::INFINITY, 0.0, 0.0));
    assert_eq!(code(infinite), ErrorType::InvalidValues);
    let body = it.get_pose(ctx, "root".into(), "cup_body".into());
    assert_eq!(code(body), ErrorType::OperationInvalidNode);
    let unknown = it.set_pose(ctx, "nowhere".into(), "cup".into(), at(0.0, 0.0, 0.0));
    assert_eq!(code(unknown), ErrorType::NonExistingNode);

    let point = Coord3D {
        x: 1.0,
        y: 2.0,
        z: 3.0,
    };
    let (_, there) = it
        .transform(ctx, "root".into(), "cup".into(), point)
        .expect("a point");
    assert_eq!([there.x, there.y, there.z], [301.0, 702.0, 103.0]);
    let matrix = it
        .get_transformation_matrix(ctx, "root".into(), "cup".into())
        .expect("a matrix");
    assert_eq!((matrix.rows, matrix.cols, matrix.data.len()), (4, 4, 16));
    assert_eq!(
        [matrix.data[3], matrix.data[7], matrix.data[11]],
        [300.0, 700.0, 100.0]
    );

    let plane = Plane3D {
        py: 5.0,
        nx: 1.0,
        ..Plane3D::default()
    };
    assert_eq!(it.set_plane(ctx, "floor".into(), plane.clone()), Ok(true));
    let wrong = it.set_plane(ctx, "cup".into(), plane);
    assert_eq!(code(wrong), ErrorType::OperationInvalidNode);
    let wrong = it.set_scale(ctx, "floor".into(), 1.0, 1.0, 1.0);
    assert_eq!(code(wrong), ErrorType::OperationInvalidNode);
    assert!(it.collide(ctx, "cup".into(), "table_top".into()));
    assert!(!it.collide(ctx, "cup".into(), "nowhere".into()));
    let floor = worker.get_node(ctx, "floor".into()).expect("a node");
    assert!(
        floor.element.contains(r#"size="4000,4000,10""#),
        "{}",
        floor.element
    );
    assert!(
        floor.element.contains(r#"nx="1" py="5""#),
        "{}",
        floor.element
    );

    test.params.refuse_collisions = true;
    let ctx: &mut Context = &mut test;
    inner_model_generated::Worker::params_changed(&mut worker, ctx, &[]).expect("a change");
    let into = InnerModelManager::set_pose(
        &mut worker.manager(ctx),
        ctx,
        "arm".into(),
        "cup".into(),
        at(0.0, 200.0, 0.0),
    );
    assert_eq!(code(into), ErrorType::Collision);
}

#[test]
fn scales_attributes_and_clouds() {
    let (mut worker, mut test) = start("house.xml");
    let ctx: &mut Context = &mut test;
    let it: &mut dyn InnerModelManager<Context> = &mut worker.manager(ctx);
    assert_eq!(
        it.set_scale(ctx, "mast_body".into(), 1.0, 2.0, 3.0),
        Ok(true)
    );
    let negative = it.set_scale(ctx, "mast_body".into(), 1.0, -2.0, 3.0);
    assert_eq!(code(negative), ErrorType::InvalidValues);

    let (id, name) = (|| "bowl".to_owned(), || "content".to_owned());
    let text = str::to_owned;
    let missing = it.get_attribute(ctx, id(), name());
    assert_eq!(code(missing), ErrorType::NonExistingAttribute);
    let missing = it.set_attribute(ctx, id(), name(), text("string"), text("soup"));
    assert_eq!(code(missing), ErrorType::NonExistingAttribute);
    assert_eq!(
        it.add_attribute(ctx, id(), name(), text("string"), text("soup")),
        Ok(true)
    );
    let again = it.add_attribute(ctx, id(), name(), text("string"), text("soup"));
    assert_eq!(code(again), ErrorType::AttributeAlreadyExists);
    assert_eq!(
        it.set_attribute(ctx, id(), name(), text("string"), text("rice")),
        Ok(true)
    );
    let found = it.get_attribute(ctx, id(), name());
    assert_eq!(found, Ok((true, text("string"), text("rice"))));
    let nodes = it.get_all_node_information(ctx).expect("all nodes");
    let bowl = nodes.iter().find(|node| node.id == "bowl").expect("a node");
    assert_eq!(bowl.attributes["content"].value, "rice");
    assert_eq!(it.remove_attribute(ctx, id(), name()), Ok(true));

    let point = |x: f32| Colored3DPoint {
        x,
        r: 255,
        ..Colored3DPoint::default()
    };
    it.set_point_cloud_data(ctx, "seen_points".into(), vec![point(1.0), point(2.0)]);
    // More points than the parameter allows, and points of a node without them, change nothing.
    it.set_point_cloud_data(ctx, "seen_points".into(), vec![point(3.0); 11]);
    it.set_point_cloud_data(ctx, "bowl".into(), vec![point(3.0)]);
    let cloud = worker
        .get_cloud(ctx, "seen_points".into())
        .expect("a cloud");
    assert_eq!(
        cloud.iter().map(|p| (p.x, p.red)).collect::<Vec<_>>(),
        [(1.0, 255), (2.0, 255)]
    );
}

/// Each pose is within the numbers of the interface; their sum is not.
#[test]
fn a_result_that_is_no_float_is_an_internal_error() {
    let (mut worker, mut test) = start("robot.xml");
    let ctx: &mut Context = &mut test;
    let it: &mut dyn InnerModelManager<Context> = &mut worker.manager(ctx);
    for (item, base) in [("far", "root"), ("farther", "far")] {
        let pose = at(3e38, 0.0, 0.0);
        let added = it.add_transform(ctx, item.into(), "static".into(), base.into(), pose);
        assert_eq!(added, Ok(true));
    }
    let (root, far, farther) = (
        || "root".to_owned(),
        || "far".to_owned(),
        || "farther".to_owned(),
    );
    let origin = Coord3D::default;
    let pose = it.get_pose(ctx, root(), farther());
    assert_eq!(code(pose), ErrorType::InternalError);
    let point = it.transform(ctx, root(), farther(), origin());
    assert_eq!(code(point), ErrorType::InternalError);
    let matrix = it.get_transformation_matrix(ctx, root(), farther());
    assert_eq!(code(matrix), ErrorType::InternalError);
    let near = it
        .transform(ctx, far(), farther(), origin())
        .expect("a point");
    assert!((near.1.x - 3e38).abs() < 1e32, "{near:?}");
    let wrong = Coord3D {
        y: f32::NAN,
        ..origin()
    };
    let wrong = it.transform(ctx, far(), farther(), wrong);
    assert_eq!(code(wrong), ErrorType::InvalidValues);
}
