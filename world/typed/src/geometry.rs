//! The types of `geometry.gdsl`, which comes with the framework. Generated code exports those of its
//! schema, and has the functions of its view and its changes for them.
//!
//! This is what `rcgen` prints for a copy of the file (`codegen/rcgen/tests/all/committed.rs`).

use crate as typed;

typed::node!(
    /// Something with a position and an orientation.
    Frame, "Frame"
);
typed::reads! { 's Frame;

    /// `string`. `None` if it has no value.
    name: &'s str = typed::read::text, "name";
}
typed::node!(
    /// What holds between two frames, when something refers to it.
    GeometricRelation, "GeometricRelation"
);
typed::node!(
    Position, "Position"
);
typed::reads! { 's Position;

    /// `float[3] unit "m" optional`. `None` if it has no value.
    coordinates: [f64; 3] = typed::read::numbers::<3>, "coordinates";
}
typed::node!(
    /// Angles about x, y and z.
    Orientation, "Orientation"
);
typed::reads! { 's Orientation;

    /// `float[3] unit "rad" optional`. `None` if it has no value.
    angles: [f64; 3] = typed::read::numbers::<3>, "angles";
}
typed::node!(
    Pose, "Pose"
);
typed::node!(
    Twist, "Twist"
);
typed::reads! { 's Twist;

    /// `float[3] unit "m/s"`. `None` if it has no value.
    linear: [f64; 3] = typed::read::numbers::<3>, "linear";

    /// `float[3] unit "rad/s"`. `None` if it has no value.
    angular: [f64; 3] = typed::read::numbers::<3>, "angular";
}
typed::edge!(
    /// Where a child is in its parent. A frame has one parent.
    Rt, "RT"
);
typed::reads! { 's Rt;

    /// `float[6] history 2s`. `None` if it has no value.
    pose: [f64; 6] = typed::read::numbers::<6>, "pose";
}
typed::edge!(
    /// Where a child is in another frame as something else knows it. It may close a loop, which
    /// need not agree with the tree.
    LoopClosure, "loop_closure"
);
typed::reads! { 's LoopClosure;

    /// `float[6]`. `None` if it has no value.
    pose: [f64; 6] = typed::read::numbers::<6>, "pose";
}
typed::edge!(
    Of, "of"
);
typed::edge!(
    WithRespectTo, "with_respect_to"
);
typed::edge!(
    ComposedBy, "composed_by"
);
