//! A component in Python that shares a world with one in Rust.

use crate::python_site::{names_of_others, second_component, up, workspace};
use rc_test_site::site::Site;

const CDSL: &str = "Component porter
{
    Communications { };
    language python;
    period 20ms;
    world \"home.gdsl\" as g { writes door, RT, door.opened stream 20ms; reads room; };
};
";

const WORKER: &str = r#"from datetime import timedelta

from porter import Context, Worker
from porter.world import Door, RoomChange
from robocomp.world import Behind, TooEarly, TooLate


def say(*words: object) -> None:
    print(*words, flush=True)


class SpecificWorker(Worker):
    def initialize(self, ctx: Context) -> None:
        self.opened = 0.0
        self.has_joined = False

    def compute(self, ctx: Context) -> None:
        if ctx.g.has_joined() and not self.has_joined:
            self.has_joined = True
            say("joined")
        if ctx.g.snapshot().all(Door):
            self.opened = (self.opened + 0.01) % 1.0
            with ctx.g.change() as edit:
                edit.door("front").opened = self.opened

    def room_changed(self, ctx: Context, change: RoomChange) -> None:
        for room in change.added:
            say("room", room.name, room.length, room.type)
            with ctx.g.change() as edit:
                door = edit.add_door("front")
                door.width = 0.8
                edit.rt(room, door).pose = [1.2, 0.0, 0.0, 0.0, 0.0, 0.0]
            self.look(ctx, str(edit.token))
        for room in change.changed:
            say("changed", room.name, change.attributes(room), room.length)

    def look(self, ctx: Context, token: str) -> None:
        now = ctx.g.snapshot()
        say("has", ctx.g.has(token), now.door("front").width, now.door("front").opened)
        try:
            ctx.g.snapshot(after="ff:1", limit=timedelta(milliseconds=300))
        except Behind as error:
            say("behind", error.token, ctx.g.wait_for(token, timedelta(0)))
        rt = now.rt("kitchen", "front")
        say("edge", rt and rt.pose, now.rt("front", "kitchen"))
        say("at", ctx.g.transform("kitchen", (1.0, 0.0, 0.0), "front"))
        say("doors", now.doors_of("kitchen"), now.doors_of(now.node("kitchen"))[0].name)
        say("rows", now.graph.query("MATCH (d:door) WHERE d.width > 0.5 RETURN d.name"))
        for wrong in (self.range, self.right, self.name, self.member):
            try:
                wrong(ctx)
            except (AttributeError, KeyError, ValueError) as error:
                say("refused", type(error).__name__, error)
        say("unchanged", ctx.g.snapshot().door("front").width, len(ctx.g.snapshot().all(Door)))
        try:
            ctx.g.transform("kitchen", (0.0, 0.0, 0.0), "front", ctx.now() + timedelta(hours=1))
        except TooLate as error:
            say("too late", error.newest <= ctx.now())
        try:
            ctx.g.transform("kitchen", (0.0, 0.0, 0.0), "front", 1)
        except (KeyError, TooEarly):
            say("too early")

    def range(self, ctx: Context) -> None:
        with ctx.g.change() as edit:
            edit.add_door("other")
            edit.door("front").width = -1.0

    def right(self, ctx: Context) -> None:
        with ctx.g.change() as edit:
            edit.add_node("room", "hall")

    def name(self, ctx: Context) -> None:
        ctx.g.snapshot().door("frnt")

    def member(self, ctx: Context) -> None:
        with ctx.g.change() as edit:
            edit.door("front").widht = 0.9
"#;

/// Starts `porter` and `room_keeper`, which is in Rust, in a world with the whole schema of the latter, and
/// waits until the latter has found the door of the former.
fn start_beside_room_keeper(site: &Site) {
    site.write_ddsl(
        "Deployment patrol\n{\n    World g { schema \"porter/home.gdsl\"; };\n    \
         Component room_keeper { cdsl \"../room_keeper/room_keeper.cdsl\"; };\n    \
         Component porter { cdsl \"porter/porter.cdsl\"; };\n};\n",
    );
    let started = up(site, &[]);
    assert_eq!(started.code, 0, "{started:?}\n{}", site.log("porter"));
    site.await_in_log("room_keeper", "door front of 0.8 m at 1.2 0");
}

/// The room is that of `room_keeper` in Rust, which finds the door there.
#[test]
fn a_worker_in_python_shares_a_world_with_one_in_rust() {
    let test = "a_worker_in_python_shares_a_world_with_one_in_rust";
    let _names = names_of_others();
    let home = include_str!("../../../components/interfaces/home.gdsl");
    let files = [
        ("porter.cdsl", CDSL),
        ("home.gdsl", home),
        ("src/specific_worker.py", WORKER),
    ];
    let Some(site) = workspace("python_world", "porter", &files, test) else {
        return;
    };
    start_beside_room_keeper(&site);
    site.await_in_log("room_keeper", "door front is open by");
    site.await_in_log("porter", "too early");
    site.await_in_log("porter", "joined");
    let log = site.log("porter");
    for line in [
        "room kitchen 4.0 room",
        "has True 0.8 None",
        "behind ff:1 True",
        "edge [1.2, 0.0, 0.0, 0.0, 0.0, 0.0] None",
        "at (2.2, 0.0, 0.0)",
        "doors [Row(name='front', width=0.8)] front",
        "rows [Row(",
        "refused ValueError `width` of `door` is in 0:inf m, found -1",
        "refused ValueError this component does not write `room`",
        "refused KeyError",
        "refused AttributeError a change of `door` does not set 'widht'",
        "unchanged 0.8 1",
        "too late True",
    ] {
        assert!(log.contains(line), "{line}: {log}");
    }
    // Both replicas are equal, and tools know the schema of the one in Python, too.
    let set = ["world", "set", &site.network, "kitchen.length=5"];
    let set = site.rcdeploy(&set, false);
    assert_eq!(set.stdout, "kitchen.length = 5.0, was 4.0\n", "{set:?}");
    site.await_in_log("porter", "changed kitchen ['length'] 5.0");
    let world = site.rcdeploy(&["world", &site.network], false);
    assert!(world.stdout.contains("porter"), "{world:?}");
    assert_eq!(site.rcdeploy(&["down", &site.network], false).code, 0);
    site.assert_nothing_left();
}

/// The part of `home.gdsl` that an agent needs, in a domain of its own.
const PART: &str = r#"import "geometry.gdsl";
Domain doors
{
    entity room : Frame { };
    entity door : Frame { width float unit "m" 0:; };
};
"#;

const PART_WORKER: &str = r#"from porter import Context, Worker
from porter.world import Room, RoomChange


class SpecificWorker(Worker):
    def compute(self, ctx: Context) -> None:
        pass

    def room_changed(self, ctx: Context, change: RoomChange) -> None:
        for room in change.added:
            print("room", room.name, sorted(name for name in dir(Room) if name in ("name", "length")), flush=True)
            with ctx.g.change() as edit:
                door = edit.add_door("front")
                door.width = 0.8
                edit.rt(room, door).pose = [1.2, 0.0, 0.0, 0.0, 0.0, 0.0]
        for room in change.changed:
            rows = ctx.g.snapshot().graph.query("MATCH (r:room) RETURN r.length")
            print("changed", room.name, change.attributes(room), rows[0][0], flush=True)
"#;

/// The component in Rust and the network have the whole schema.
#[test]
fn a_worker_in_python_that_declares_a_part_of_the_schema_shares_the_whole_world() {
    let test = "a_worker_in_python_that_declares_a_part_of_the_schema_shares_the_whole_world";
    let _names = names_of_others();
    let home = include_str!("../../../components/interfaces/home.gdsl");
    let cdsl = CDSL.replace("home.gdsl", "doors.gdsl");
    let cdsl = cdsl.replace(", door.opened stream 20ms", "");
    let files = [
        ("porter.cdsl", &*cdsl),
        ("doors.gdsl", PART),
        ("home.gdsl", home),
        ("src/specific_worker.py", PART_WORKER),
    ];
    let Some(site) = workspace("python_part", "porter", &files, test) else {
        return;
    };
    start_beside_room_keeper(&site);
    site.await_in_log("porter", "room kitchen ['name']");
    let set = [
        "world",
        "set",
        &site.network,
        "kitchen.length=5",
        "front.opened=0.5",
    ];
    let set = site.rcdeploy(&set, false);
    assert_eq!(set.code, 0, "{set:?}");
    site.await_in_log("porter", "changed kitchen ['length'] 5.0");
    site.await_in_log("room_keeper", "door front is open by 0.50");
    let state = site.rcdeploy(&["world", &site.network, "--format", "json"], false);
    let state: serde_json::Value = serde_json::from_str(&state.stdout).expect("JSON");
    let replicas = state["replicas"].as_array().expect("a list");
    assert_eq!(replicas.len(), 2, "{state}");
    assert_eq!(replicas[0]["digest"], replicas[1]["digest"], "{state}");
    assert_eq!(site.rcdeploy(&["down", &site.network], false).code, 0);
    site.assert_nothing_left();
}

/// The calls of an agent of DSR, as `pydsr` has them.
const MAKER: &str = r#"from maker import Context, Worker
from robocomp.dsr import Attribute, DSRGraph, Edge, Node, inner_api, rt_api


class SpecificWorker(Worker):
    def initialize(self, ctx: Context) -> None:
        self.g = DSRGraph(ctx.g)
        self.rt_api = rt_api(self.g)
        self.inner = inner_api(self.g)
        self.step = 0

    def compute(self, ctx: Context) -> None:
        g = self.g
        if self.step == 0:
            world = Node(g.get_agent_id(), "world", "world")
            print("inserted", g.insert_node(world) == g.get_id_from_name("world"), g.insert_node(world))
            robot = Node(g.get_agent_id(), "omnirobot", "robot")
            g.add_or_modify_attrib_local(robot, "level", 1)
            robot.attrs["color"] = Attribute("Blue", g.get_agent_id())
            g.insert_node(robot)
            print("levels", g.get_node_level(robot), g.get_attrib_by_name(robot, "color"))
            laser = g.insert_node(Node(g.get_agent_id(), "laser", "laser"))
            robot = g.get_node("robot")
            self.rt_api.insert_or_assign_edge_RT(g.get_node("world"), robot.id, [1, 2, 0], [0, 0, 1.5707963267948966])
            self.rt_api.insert_or_assign_edge_RT(robot, laser, [0.5, 0, 0], [0, 0, 0])
            edge = Edge(robot.id, g.get_node("world").id, "has", g.get_agent_id())
            print("edge", g.insert_or_assign_edge(edge), g.get_edge("world", "robot", "has"))
            print("types", [n.name for n in g.get_nodes_by_types(["laser", "world"])], len(g.get_edges_by_type("RT")))
            print("matrix", self.inner.get_transformation_matrix("world", "laser").round(6).tolist())
            print("point", self.inner.transform("world", [1.0, 0.0, 0.0], "laser").round(6).tolist())
            print("pose", self.inner.transform_axis("world", [0, 0, 0, 0, 0, 0.5], "robot").round(6).tolist())
            print("angles", self.inner.get_euler_xyz_angles("world", "laser").round(6).tolist())
            print("nowhere", self.inner.transform("world", "nobody"), g.get_node("nobody"))
            print("parent", g.get_name_from_id(g.get_parent_id(g.get_node("laser"))))
            self.step = 1
        elif self.step == 1 and g.get_node("watcher") is not None:
            robot = g.get_node("robot")
            g.add_or_modify_attrib_local(robot, "level", 2)
            g.add_or_modify_attrib_local(robot, "battery_level", 0.5)
            g.update_node(robot)
            self.rt_api.insert_or_assign_edge_RT(g.get_node("world"), robot.id, [3.0, 2.0, 0.0], [0.0, 0.0, 0.0])
            g.delete_edge("world", "robot", "has")
            g.delete_node("laser")
            self.step = 2
            print("made")
"#;

const WATCHER: &str = r#"from robocomp.dsr import DSRGraph, Node, signals
from watcher import Context, Worker


class SpecificWorker(Worker):
    def initialize(self, ctx: Context) -> None:
        self.g = DSRGraph(ctx.g)
        signals.connect(self.g, signals.UPDATE_NODE, lambda id, type: print("node", type))
        signals.connect(self.g, signals.UPDATE_NODE_ATTR, self.update_node_att)
        signals.connect(self.g, signals.UPDATE_EDGE, lambda fr, to, type: print("edge", type))
        signals.connect(self.g, signals.UPDATE_EDGE_ATTR, lambda fr, to, type, names: print("moved", type, sorted(names)))
        signals.connect(self.g, signals.DELETE_EDGE, lambda fr, to, type: print("no edge", type))
        signals.connect(self.g, signals.DELETE_NODE, lambda id: print("no node", id > 0))

    def compute(self, ctx: Context) -> None:
        if self.g.get_node("laser") is not None and self.g.get_node("watcher") is None:
            self.g.insert_node(Node(self.g.get_agent_id(), "person", "watcher"))

    def update_node_att(self, id: int, names: list[str]) -> None:
        node = self.g.get_node(id)
        print("attributes", node.name, sorted(names), node.attrs["level"].value)
"#;

#[test]
fn agents_of_dsr_keep_their_calls() {
    let test = "agents_of_dsr_keep_their_calls";
    let cdsl = |name: &str| {
        format!(
            "Component {name}\n{{\n    Communications {{ }};\n    language python;\n    period 20ms;\n    \
             world \"dsr.gdsl\" as g {{ writes node shared, RT shared, has shared; reads node, RT; }};\n}};\n"
        )
    };
    let (maker, watcher) = (cdsl("maker"), cdsl("watcher"));
    let files = [("maker.cdsl", &*maker), ("src/specific_worker.py", MAKER)];
    let Some(site) = workspace("python_dsr", "maker", &files, test) else {
        return;
    };
    let files = [
        ("watcher.cdsl", &*watcher),
        ("src/specific_worker.py", WATCHER),
    ];
    second_component(&site, "watcher", &files);
    site.write_ddsl(
        "Deployment patrol\n{\n    World g { schema \"dsr.gdsl\"; };\n    \
         Component maker { cdsl \"maker/maker.cdsl\"; };\n    \
         Component watcher { cdsl \"watcher/watcher.cdsl\"; };\n};\n",
    );
    let started = up(&site, &[]);
    assert_eq!(started.code, 0, "{started:?}\n{}", site.log("maker"));
    site.await_in_log("maker", "made");
    site.await_in_log("watcher", "no node True");
    let log = site.log("maker");
    for line in [
        "inserted True None",
        "levels 1 Blue",
        "edge True Edge(",
        "types ['laser', 'world'] 2",
        "matrix [[0.0, -1.0, 0.0, 1.0], [1.0, 0.0, 0.0, 2.5], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]]",
        "point [1.0, 3.5, 0.0]",
        "pose [1.0, 2.0, 0.0, 0.0, 0.0, 2.070796]",
        "angles [0.0, 0.0, 1.570796]",
        "nowhere None None",
        "parent robot",
    ] {
        assert!(log.replace("-0.0", "0.0").contains(line), "{line}: {log}");
    }
    let log = site.log("watcher");
    for line in [
        "node omnirobot",
        "edge RT",
        "attributes robot ['battery_level', 'level'] 2",
        "moved RT ['rt_rotation_euler_xyz', 'rt_translation']",
        "no edge has",
    ] {
        assert!(log.contains(line), "{line}: {log}");
    }
    assert_eq!(site.rcdeploy(&["down", &site.network], false).code, 0);
    site.assert_nothing_left();
}
