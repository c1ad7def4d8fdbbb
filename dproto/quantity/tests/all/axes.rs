//! Axes of frames.

use rc_quantity::Axes;
use rc_quantity::rotation::{IDENTITY, product, turned};

fn axes(text: &str) -> Axes {
    text.parse()
        .unwrap_or_else(|error| panic!("{text}: {error}"))
}

#[test]
fn handedness_follows_from_the_directions() {
    for (text, is_right_handed) in [
        ("ahead, left, up", true),
        ("right, ahead, up", true),
        ("right, down, ahead", true),
        ("right, up, ahead", false),
        ("ahead, right, up", false),
        ("ahead, right, down", true),
    ] {
        assert_eq!(axes(text).is_right_handed(), is_right_handed, "{text}");
        assert_eq!(axes(text).to_string(), text);
    }
    for wrong in [
        "",
        "ahead, left",
        "ahead, back, up",
        "ahead, left, top",
        "ahead, left, up, up",
    ] {
        assert!(wrong.parse::<Axes>().is_err(), "{wrong}");
    }
}

#[test]
fn a_point_ahead_is_a_point_ahead_in_all_axes() {
    let lidar = axes("right, ahead, up");
    assert_eq!(
        turned(&lidar.matrix_to(Axes::ROS), [1.0, 2.0, 3.0]),
        [2.0, -1.0, 3.0]
    );
    let inner = Axes::INNER_MODEL;
    assert_eq!(
        turned(&inner.matrix_to(Axes::ROS), [1.0, 2.0, 3.0]),
        [3.0, -1.0, 2.0]
    );
    assert_eq!(
        turned(&inner.matrix_to(Axes::ROS_OPTICAL), [1.0, 2.0, 3.0]),
        [1.0, -2.0, 3.0]
    );
    let there_and_back = product(&Axes::ROS.matrix_to(inner), &inner.matrix_to(Axes::ROS));
    assert_eq!(there_and_back, IDENTITY);
    // A turn about the line up keeps its sense between systems of one hand, and changes it else.
    let about_up = [0.0, 0.3, 0.0];
    assert_eq!(
        turned(&inner.axial_matrix_to(Axes::ROS), about_up),
        [0.0, 0.0, -0.3]
    );
    let about_up = [0.0, 0.0, 0.3];
    assert_eq!(
        turned(&lidar.axial_matrix_to(Axes::ROS), about_up),
        [0.0, 0.0, 0.3]
    );
}
