//! Members that hold the opposite of what they mean.

use crate::library;
use rc_plans::Network;

const TEXT: &str = r#"
axes innermodel :: right, up, ahead
axes ros :: ahead, left, up
algebraic xyz :: Scalar{x, y, z}

dproto gyro :: geometry
{
    semantic = AngularVelocity coord = cartesian algebraic = xyz
    ddr = :: ROS{a/Gyro} dr = { XGyr = x, YGyr = -y, ZGyr = z } axes = innermodel
}
dproto other :: geometry
{
    semantic = AngularVelocity coord = cartesian algebraic = xyz
    ddr = :: ROS{a/Other} dr = { XGyr = x, YGyr = -y, ZGyr = z } axes = innermodel
}
dproto plain :: geometry
{
    semantic = AngularVelocity coord = cartesian algebraic = xyz
    ddr = :: ROS{a/Plain} dr = { x = x, y = y, z = z } axes = innermodel
}
dproto turning :: geometry
{
    semantic = AngularVelocity coord = cartesian algebraic = xyz
    ddr = :: ROS{geometry_msgs/Vector3} dr = { x = x, y = y, z = z } axes = ros
}
"#;

#[test]
fn a_member_may_be_the_opposite_of_a_value() {
    let library = library(TEXT);
    let network = Network::new(&library);
    let run = |from: &str, to: &str, input: [f64; 3]| {
        let plan = network.plan(from, to).expect("a plan");
        plan.program.run(&input).expect("numbers")
    };
    // About the axis up, the member grows to the left, as in ROS; about the others, the sense of a left-handed
    // frame is that of the left hand.
    assert_eq!(run("gyro", "turning", [1.0, 2.0, 3.0]), [-3.0, 1.0, 2.0]);
    assert_eq!(run("turning", "gyro", [-3.0, 1.0, 2.0]), [1.0, 2.0, 3.0]);
    assert_eq!(run("gyro", "plain", [1.0, 2.0, 3.0]), [1.0, -2.0, 3.0]);
    // Two with the same signs keep all bits.
    let same = network.plan("gyro", "other").expect("a plan");
    let program = format!("{:?}", same.program);
    assert!(!program.contains("Negate"), "{program}");
    let nothing = [0.0, -0.0, 1.5].map(f64::to_bits);
    let kept = run("gyro", "other", [0.0, -0.0, 1.5]);
    assert_eq!(
        kept.iter().map(|value| value.to_bits()).collect::<Vec<_>>(),
        nothing
    );
}
