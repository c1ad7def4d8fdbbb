//! The examples on the front pages of library crates. Rustdoc compiles and runs them here in one
//! program; a program for each crate would take minutes.

macro_rules! page {
    ($name:ident, $path:literal) => {
        #[doc = include_str!($path)]
        pub mod $name {}
    };
}

page!(graph_drawing, "../../../graph/drawing/src/example.md");
page!(graph_exchange, "../../../graph/exchange/src/example.md");
page!(graph_language, "../../../graph/language/src/example.md");
page!(graph_merge, "../../../graph/merge/src/example.md");
page!(graph_pages, "../../../innermodel/pages/src/example.md");
page!(graph_schema, "../../../graph/schema/src/example.md");
page!(
    innermodel_exchange,
    "../../../innermodel/exchange/src/example.md"
);
page!(
    innermodel_language,
    "../../../innermodel/language/src/example.md"
);
page!(innermodel_mesh, "../../../innermodel/mesh/src/example.md");
page!(rc_cdsl, "../../../cdsl/src/example.md");
page!(
    rc_configuration,
    "../../../pdsl/configuration/src/example.md"
);
page!(rc_dds, "../../../middleware/dds/src/example.md");
page!(rc_ddsc, "../../../middleware/dds/ddsc/src/example.md");
page!(rc_ddsl, "../../../ddsl/src/example.md");
page!(rc_drawing, "../../../smdsl/graph/drawing/src/example.md");
page!(rc_files, "../../../vocabulary/files/src/example.md");
page!(rc_host, "../../../runtime/host/src/example.md");
page!(rc_iceoryx2, "../../../middleware/iceoryx2/src/example.md");
page!(rc_idsl, "../../../idsl/src/example.md");
page!(rc_kinematics, "../../../kinematics/src/example.md");
page!(rc_lifecycle, "../../../vocabulary/lifecycle/src/example.md");
page!(rc_local, "../../../middleware/local/src/example.md");
page!(rc_machine, "../../../smdsl/machine/src/example.md");
page!(rc_mcap, "../../../runtime/mcap/src/example.md");
page!(rc_network, "../../../middleware/network/src/example.md");
page!(rc_pdsl, "../../../pdsl/src/example.md");
page!(rc_plans, "../../../prototypes/plans/src/example.md");
page!(rc_prototypes, "../../../prototypes/src/example.md");
page!(rc_robot, "../../../kinematics/model/src/example.md");
page!(
    rc_ros_types,
    "../../../middleware/ros2/types/src/example.md"
);
page!(rc_ros2, "../../../middleware/ros2/src/example.md");
page!(rc_scheduling, "../../../runtime/scheduling/src/example.md");
page!(rc_smdsl, "../../../smdsl/src/example.md");
page!(rc_state_graph, "../../../smdsl/graph/src/example.md");
page!(rc_syntax, "../../../syntax/src/example.md");
page!(rc_urdf, "../../../syntax/urdf/src/example.md");
page!(rc_world_member, "../../../world/member/src/example.md");
page!(rc_world_typed, "../../../world/typed/src/example.md");
page!(rc_xml, "../../../syntax/xml/src/example.md");
