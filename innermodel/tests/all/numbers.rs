//! Transforms equal what other ways of computing them give.

use crate::load;
use innermodel::kinds::{Axis, Encoder, Joint, Prismatic};
use innermodel::{
    InnerModel, Kind, NewNode, Point, Pose, Snapshot, Time, Transform, Vector, frames,
};
use nalgebra::{Isometry3, Matrix4, Rotation3, Translation3, UnitQuaternion};

/// Another way to the matrix of a node in its parent.
fn expected_local(kind: &Kind, pose: &Pose, position: f64) -> Matrix4<f64> {
    let about = |axis: usize, angle: f64| {
        let axis = [Vector::x_axis(), Vector::y_axis(), Vector::z_axis()][axis];
        Rotation3::from_axis_angle(&axis, angle).to_homogeneous()
    };
    let [x, y, z] = pose.rotation;
    let [tx, ty, tz] = pose.translation;
    let fixed =
        Translation3::new(tx, ty, tz).to_homogeneous() * about(0, x) * about(1, y) * about(2, z);
    match kind {
        Kind::Joint(joint) => fixed * about(joint.axis.index(), position),
        Kind::Prismatic(joint) => {
            let mut by = Vector::zeros();
            by[joint.axis.index()] = position + joint.offset;
            Translation3::from(by).to_homogeneous()
        }
        _ => fixed,
    }
}

fn expected(tree: &Snapshot, to: &str, from: &str) -> Matrix4<f64> {
    let world = |id: &str| {
        let mut matrix = Matrix4::identity();
        let mut node = Some(tree.node(id).expect("a node"));
        while let Some(here) = node {
            let local = expected_local(here.kind(), &here.pose(), here.position().unwrap_or(0.0));
            matrix = local * matrix;
            node = here.parent();
        }
        matrix
    };
    world(to).try_inverse().expect("a transform") * world(from)
}

/// Equal within 1e-9 of the size of the numbers.
fn same(a: &Matrix4<f64>, b: &Matrix4<f64>) -> bool {
    (a - b).amax() <= 1e-9 * a.amax().max(b.amax()).max(1.0)
}

fn random_tree(
    u: &mut arbtest::arbitrary::Unstructured<'_>,
) -> arbtest::arbitrary::Result<InnerModel> {
    let model = InnerModel::new();
    let number = |u: &mut arbtest::arbitrary::Unstructured<'_>, size: f64| {
        Ok(f64::from(u.int_in_range(-1_000_000..=1_000_000)?) * size / 1e6)
    };
    let depth = u.int_in_range(1..=60)?;
    let count = depth + u.int_in_range(0..=30)?;
    for at in 0..count {
        let pose = Pose::new(
            number(u, 1000.0)?,
            number(u, 1000.0)?,
            number(u, 1000.0)?,
            number(u, 4.0)?,
            number(u, 4.0)?,
            number(u, 4.0)?,
        );
        let axis = *u.choose(&[Axis::X, Axis::Y, Axis::Z])?;
        let (kind, pose) = match u.int_in_range(0..=3)? {
            0 => (
                Kind::Joint(Joint {
                    axis,
                    min: -3.0,
                    max: 3.0,
                    home: 0.0,
                    max_speed: 0.0,
                    encoder: Encoder::default(),
                    port: 0,
                    low: [0.0; 3],
                    high: [0.0; 3],
                }),
                pose,
            ),
            1 => (
                Kind::Prismatic(Prismatic {
                    axis,
                    min: -100.0,
                    max: 100.0,
                    home: 0.0,
                    max_speed: 0.0,
                    encoder: Encoder::default(),
                    position: 3.0,
                    offset: number(u, 10.0)?,
                    port: 0,
                }),
                Pose::default(),
            ),
            _ => (
                Kind::Transform(innermodel::kinds::Transform::default()),
                pose,
            ),
        };
        let moves = matches!(kind, Kind::Joint(_) | Kind::Prismatic(_));
        // A chain first, then nodes anywhere.
        let parent = match at {
            0 => "root".to_owned(),
            at if at < depth => format!("n{}", at - 1),
            at => format!("n{}", u.int_in_range(0..=at - 1)?),
        };
        let position = number(u, 3.0)?;
        model
            .change(Time::ZERO, |edit| {
                let node = edit.add(&parent, NewNode::new(format!("n{at}"), kind, pose))?;
                if moves {
                    edit.set_joint(node, position)?;
                }
                Ok::<_, innermodel::Error>(())
            })
            .expect("a change");
    }
    Ok(model)
}

#[test]
fn random_trees_of_depth_60() {
    arbtest::arbtest(|u| {
        let tree = random_tree(u)?.snapshot();
        let ids: Vec<&str> = tree.nodes().map(|node| node.id()).collect();
        for _ in 0..8 {
            let (a, b) = (*u.choose(&ids)?, *u.choose(&ids)?);
            let there = tree.between(a, b).expect("two nodes");
            assert!(same(&there.matrix(), &expected(&tree, a, b)), "{a} {b}");
            // Also what is kept.
            assert_eq!(tree.between(a, b).expect("two nodes"), there);
            let back = there * tree.between(b, a).expect("two nodes");
            assert!(same(&back.matrix(), &Matrix4::identity()), "{a} {b}");
            let pose = there.pose();
            assert!(
                same(&Transform::of(&pose).matrix(), &there.matrix()),
                "{pose:?}"
            );
        }
        Ok(())
    })
    .size_min(4096)
    .budget_ms(2000);
}

#[test]
fn points_directions_poses_and_matrices_agree() {
    let model = load("arm.xml");
    let _ = model.change(Time::ZERO, |edit| {
        for joint in 1..=7 {
            edit.set_joint(&format!("joint_{joint}"), 0.3 * f64::from(joint) - 1.0)?;
        }
        Ok::<_, innermodel::Error>(())
    });
    let tree = model.snapshot();
    let between = tree.between("cup", "tip").expect("two nodes");
    let point = Point::new(1.0, 2.0, 3.0);
    let vector = Vector::new(1.0, 2.0, 3.0);
    let moved = tree.transform("cup", point, "tip").expect("a point");
    let turned = tree
        .transform_vector("cup", vector, "tip")
        .expect("a vector");
    let origin = tree
        .transform("cup", Point::origin(), "tip")
        .expect("a point");
    assert!((moved - origin - turned).norm() < 1e-9);
    let matrix = tree.matrix("cup", "tip").expect("a matrix");
    assert!((matrix.transform_point(&point) - moved).norm() < 1e-9);
    let pose = Pose::new(1.0, 2.0, 3.0, 0.1, 0.2, 0.3);
    let there = tree.transform_pose("cup", &pose, "tip").expect("a pose");
    assert!(same(
        &Transform::of(&there).matrix(),
        &(between * Transform::of(&pose)).matrix()
    ));
    let isometry = between.isometry();
    assert!(same(&isometry.to_homogeneous(), &matrix));
    assert!(same(&Transform::from_isometry(&isometry).matrix(), &matrix));
}

#[test]
fn angles_at_the_end_of_their_range_come_back() {
    for y in [std::f64::consts::FRAC_PI_2, -std::f64::consts::FRAC_PI_2] {
        let transform = Transform::of(&Pose::new(0.0, 0.0, 0.0, 0.4, y, 0.7));
        assert!(same(
            &Transform::of(&transform.pose()).matrix(),
            &transform.matrix()
        ));
    }
}

#[test]
fn frames_of_ros() {
    // Ahead of a robot is +z here and +x there; right is +x here and −y there.
    let near = |a: Vector, b: Vector| assert!((a - b).norm() < 1e-12, "{a} {b}");
    near(
        frames::point_to_ros(&Point::new(0.0, 0.0, 2000.0)).coords,
        Vector::new(2.0, 0.0, 0.0),
    );
    near(
        frames::point_to_ros(&Point::new(1000.0, 0.0, 0.0)).coords,
        Vector::new(0.0, -1.0, 0.0),
    );
    near(
        frames::point_to_ros(&Point::new(0.0, 500.0, 0.0)).coords,
        Vector::new(0.0, 0.0, 0.5),
    );
    near(
        frames::point_to_optical(&Point::new(1.0, 2.0, 3.0)).coords * 1000.0,
        Vector::new(1.0, -2.0, 3.0),
    );
    // A positive angle about y turns to the right here. In ROS, right is negative.
    let turned = Transform::of(&Pose::new(0.0, 0.0, 0.0, 0.0, 0.3, 0.0));
    let yaw = frames::to_ros(&turned).rotation;
    assert!(yaw.angle_to(&UnitQuaternion::from_euler_angles(0.0, 0.0, -0.3)) < 1e-12);
    near(
        frames::rotation_vector_to_ros(&Vector::new(0.0, 0.3, 0.0)),
        Vector::new(0.0, 0.0, -0.3),
    );
    arbtest::arbtest(|u| {
        let mut number = || Ok(f64::from(u.int_in_range(-3000..=3000)?) / 1000.0);
        let pose = Pose::new(
            number()?,
            number()?,
            number()?,
            number()?,
            number()?,
            number()?,
        );
        let (a, point) = (
            Transform::of(&pose),
            Point::new(number()?, number()?, number()?),
        );
        // To move and to convert commute, and the way back is the inverse.
        let there: Isometry3<f64> = frames::to_ros(&a);
        near(
            (there * frames::point_to_ros(&point)).coords,
            frames::point_to_ros(&a.point(&point)).coords,
        );
        assert!(same(&frames::from_ros(&there).matrix(), &a.matrix()));
        near(
            frames::point_from_ros(&frames::point_to_ros(&point)).coords,
            point.coords,
        );
        near(
            frames::vector_from_ros(&frames::vector_to_ros(&point.coords)),
            point.coords,
        );
        let camera = frames::camera_to_ros(&a) * frames::point_to_optical(&point);
        near(camera.coords, frames::point_to_ros(&a.point(&point)).coords);
        // The axis of a rotation, times its angle.
        let axis = Rotation3::from_matrix_unchecked(a.rotation).scaled_axis();
        // Half a turn has two axes, and the angle near it has half of the digits.
        let turned = |vector| UnitQuaternion::from_scaled_axis(vector);
        let like = |a: Vector, b: Vector| assert!(turned(a).angle_to(&turned(b)) < 1e-6, "{a} {b}");
        like(
            there.rotation.scaled_axis(),
            frames::rotation_vector_to_ros(&axis),
        );
        like(
            frames::rotation_vector_from_ros(&there.rotation.scaled_axis()),
            axis,
        );
        Ok(())
    })
    .budget_ms(300);
}
