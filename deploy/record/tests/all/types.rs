//! The types that the tests record.

use rc_middleware::Qos;
use rc_record::{ENCAPSULATION, Schema, Writer, keys, qos, schema};
use rc_values::description::Module;
use rc_values::{Catalog, Interface, encode_body, from_json};
use serde_json::{Value as Json, json};
use std::collections::BTreeMap;
use std::sync::Arc;

/// An interface with everything that a type can have.
pub(crate) fn interface() -> Arc<Interface> {
    let module: Module = serde_json::from_value(json!({
        "module": "RoboCompTest",
        "types": [
            {"name": "Mode", "enum": [["idle", 0], ["busy", 3]]},
            {"name": "Rows", "alias": "sequence<sequence<int32>>"},
            {"name": "Point", "struct": [{"name": "x", "type": "float32", "unit": "mm"}, {"name": "fromY", "type": "float64"}]},
            {"name": "Empty", "struct": []},
            {"name": "Scan", "struct": [
                {"name": "frameId", "type": "string"},
                {"name": "class", "type": "uint8"},
                {"name": "points", "type": "sequence<RoboCompTest::Point,8>"},
                {"name": "corner", "type": "RoboCompTest::Point[2]"},
                {"name": "mode", "type": "RoboCompTest::Mode"},
                {"name": "rows", "type": "RoboCompTest::Rows"},
                {"name": "names", "type": "dictionary<string,int64>"},
                {"name": "maybe", "type": "uint16", "optional": true},
                {"name": "bytes", "type": "sequence<uint8>"},
                {"name": "flags", "type": "bool[3]"}
            ]}
        ],
        "interfaces": [{"name": "ScanPub", "operations": [
            {"name": "newScan", "id": 1, "hash": "00000000000000aa", "pattern": "publish",
             "inputs": [{"name": "scan", "type": "RoboCompTest::Scan"}]},
            {"name": "moved", "id": 2, "hash": "00000000000000ab", "pattern": "publish",
             "inputs": [{"name": "to", "type": "RoboCompTest::Point"}, {"name": "count", "type": "uint64"}]},
            {"name": "tick", "id": 3, "hash": "00000000000000ac", "pattern": "publish"}
        ]}]
    }))
    .expect("a module");
    let catalog = Catalog::new(&[module]).expect("a catalog");
    catalog
        .interface("RoboCompTest::ScanPub")
        .expect("an interface")
        .clone()
}

/// The values of the tests: the operation, the value in our names, and in those of ROS 2.
pub(crate) fn values() -> [(&'static str, Json, Json); 2] {
    let scan = |frame: &str, class: &str, from: &str, rows: Json, names: Json, maybe: Json| {
        let point = |x: f64, y: f64| json!({ "x": x, from: y });
        json!({
            frame: "laser", class: 7, "points": [point(1.5, -2.25), point(0.5, 1e300)],
            "corner": [point(1.0, 2.0), point(3.0, 4.0)],
            "mode": if class == "class" { json!("busy") } else { json!(3) },
            "rows": rows, "names": names, "maybe": maybe, "bytes": [0, 1, 255], "flags": [true, false, true]
        })
    };
    let ours = scan(
        "frameId",
        "class",
        "fromY",
        json!([[1, 2], [], [3]]),
        json!({"a": 1, "b": -2}),
        json!(9),
    );
    let theirs = scan(
        "frame_id",
        "class_value",
        "from_y",
        json!([{"data": [1, 2]}, {"data": []}, {"data": [3]}]),
        json!([{"key": "a", "value": 1}, {"key": "b", "value": -2}]),
        json!([9]),
    );
    let moved = json!({"to": {"x": 2.5, "fromY": 0.125}, "count": 18_446_744_073_709_551_615_u64});
    let moved_there =
        json!({"to": {"x": 2.5, "from_y": 0.125}, "count": 18_446_744_073_709_551_615_u64});
    [
        ("newScan", json!({ "scan": ours }), theirs),
        ("moved", moved, moved_there),
    ]
}

/// A message of an operation.
pub(crate) fn message(interface: &Interface, operation: &str, value: &Json) -> Vec<u8> {
    let operation = interface.operation(operation).expect("an operation");
    let value = from_json(&operation.request, value).expect("a value");
    let mut data = ENCAPSULATION.to_vec();
    data.extend(encode_body(&value).expect("to encode"));
    data
}

/// The schema of an operation.
pub(crate) fn schema_of(interface: &Interface, operation: &str) -> Schema {
    let operation = interface.operation(operation).expect("an operation");
    schema::sample(&interface.name, operation, None)
}

/// Adds a channel for an operation.
pub(crate) fn channel(
    writer: &mut Writer,
    interface: &Interface,
    operation: &str,
) -> rc_record::ChannelId {
    let address = format!("net/scanner/ScanPub/{operation}");
    let metadata = BTreeMap::from([
        (keys::ADDRESS.to_owned(), address.clone()),
        (
            keys::QOS.to_owned(),
            qos::profile(&Qos {
                depth: 0,
                ..Qos::SUBSCRIBER
            }),
        ),
    ]);
    let schema = schema_of(interface, operation);
    writer.channel(&format!("/{address}"), "cdr", Some(schema), metadata)
}
