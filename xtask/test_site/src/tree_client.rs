//! RoboComp's interface `InnerModelManager` over the middleware of a component: each operation, and
//! each code of an error.

use crate::site::Site;
use interfaces::robo_comp_inner_model_manager::inner_model_manager::{
    self as calls, InnerModelManagerClient,
};
use interfaces::robo_comp_inner_model_manager::{
    Colored3DPoint, Coord3D, ErrorType, JointType, MeshType, NodeType, Plane3D, Pose3D,
};
use rc_management::Client;
use rc_management::component::Request;
use rc_management::observation::{Described, SlotDescription};
use rc_middleware::typed::TypedClient;
use rc_middleware::{
    Address, Backend, Endpoint, Environment, ExternalType, Qos, Settings, TypeIdentity, WakeEvent,
};
use rc_values::Catalog;
use rc_values::description::Module;
use serde_json::json;
use std::fmt::Debug;
use std::time::Duration;

/// The longest call. Each reply is expected long before.
const LIMIT: Duration = Duration::from_secs(20);
const SLOT: &str = "InnerModelManager";

/// The code of an exception.
fn code<T: Debug>(call: Result<T, calls::InnerModelManagerErrorOrCall>) -> ErrorType {
    match call {
        Err(calls::InnerModelManagerErrorOrCall::InnerModelManagerError(error)) => error.err,
        other => panic!("{other:?}"),
    }
}

/// Joins the network of a component as another component would.
fn join(
    site: &Site,
    component: &str,
    described: &Described,
    slot: &SlotDescription,
) -> Box<dyn Backend> {
    let middleware = slot.middleware.as_str();
    let mut settings = Settings::default();
    let own = described.middlewares.get(middleware).into_iter().flatten();
    // The name of the component's own node is not that of the test.
    for (name, text) in own.filter(|(name, _)| *name != "node") {
        let key = rc_vocabulary::key(middleware, name).expect("a key");
        settings.set(middleware, name, key.kind.parse(text).expect("a value"));
    }
    let environment = Environment {
        network: site.network.clone(),
        instance: format!("test_of_{component}"),
        directory: site.directory(),
        wake_event: WakeEvent::new().expect("a wake event"),
        settings,
    };
    let backend = match middleware {
        "dds" => rc_dds::connect(&environment),
        "ros2" => rc_ros2::connect(&environment, &[]),
        _ => rc_iceoryx2::connect(&environment),
    };
    backend.expect("the middleware")
}

fn endpoint(described: &Described, slot: &SlotDescription) -> Endpoint {
    let modules = described.types.iter();
    let modules: Vec<Module> = modules
        .map(|module| serde_json::from_value(module.clone()).expect("a module"))
        .collect();
    let catalog = Catalog::new(&modules).expect("types");
    let interface = catalog.interface(&slot.interface).expect("the interface");
    let external = slot.operations.iter().filter_map(|operation| {
        Some(ExternalType {
            slot: slot.name.clone(),
            operation: operation.name.clone(),
            id: interface.operation(&operation.name)?.id,
            type_name: operation.external_type.clone()?,
        })
    });
    let address = slot.address.as_deref().expect("an address");
    Endpoint {
        address: Address::parse(address).expect("an address"),
        types: TypeIdentity {
            name: slot.interface.clone(),
            hash: u64::from_str_radix(&slot.hash, 16).expect("a hash"),
        },
        qos: Qos::CALL,
        external_types: external.collect(),
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

impl Site {
    /// Calls each operation of a component that serves the house and refuses collisions, and gets
    /// each code of an error.
    pub fn call_each_operation(&self, component: &str) {
        let socket = self.directory().socket(component);
        let mut management = Client::connect(&socket, LIMIT).expect("its socket");
        let described: Described = management
            .call(&Request::Describe {}, LIMIT)
            .expect("a description");
        let slots = described.slots.iter();
        let slot = slots
            .clone()
            .find(|slot| slot.name == SLOT)
            .expect("the slot");
        let backend = join(self, component, &described, slot);
        let client = backend
            .client(&endpoint(&described, slot))
            .expect("a client");
        Self::until("the component is found", || client.peers() == 1);
        let mut it = InnerModelManagerClient::new(TypedClient::new(client, LIMIT));
        add_and_remove(&mut it);
        move_and_measure(&mut it);
        attributes(&mut it);
        let into = it.set_pose("root", "bowl", &at(5000.0, 1000.0, 0.0));
        assert_eq!(code(into), ErrorType::Collision);
        // A command has no reply: the points are there a little later.
        let points = vec![Colored3DPoint::default(); 3];
        it.set_point_cloud_data("seen_points", &points)
            .expect("to send points");
        let operation = format!("{component}.InnerModel.getCloud");
        Self::until("the cloud has its points", || {
            let reply = self.call_tree(&operation, &json!({"id": "seen_points"}));
            let cloud = reply["result"]["return"].as_array();
            cloud.is_some_and(|cloud| cloud.len() == points.len())
        });
    }
}

fn add_and_remove(it: &mut InnerModelManagerClient) {
    let here = at(100.0, 3000.0, 0.0);
    let added = it.add_transform("stand", "static", "root", &here);
    assert_eq!(added, Ok(true));
    let again = it.add_transform("stand", "static", "root", &here);
    assert_eq!(code(again), ErrorType::NodeAlreadyExists);
    let wrong = it.add_transform("other", "ode", "root", &here);
    assert_eq!(code(wrong), ErrorType::InvalidEngine);
    let joint = JointType {
        min: -1.0,
        max: 1.0,
        axis: "y".into(),
        ..JointType::default()
    };
    assert_eq!(it.add_joint("turn", "stand", &joint), Ok(true));
    let wrong = JointType {
        max: -2.0,
        ..joint.clone()
    };
    let wrong = it.add_joint("other", "stand", &wrong);
    assert_eq!(code(wrong), ErrorType::InvalidValues);
    let mesh = |path: &str| MeshType {
        scale_x: 1.0,
        scale_y: 1.0,
        scale_z: 1.0,
        mesh_path: path.into(),
        ..MeshType::default()
    };
    assert_eq!(it.add_mesh("pole", "turn", &mesh("mast.obj")), Ok(true));
    let missing = it.add_mesh("other", "turn", &mesh("none.obj"));
    assert_eq!(code(missing), ErrorType::InvalidPath);
    let plane = Plane3D {
        width: 100.0,
        height: 50.0,
        thickness: 10.0,
        ..Plane3D::default()
    };
    assert_eq!(it.add_plane("sign", "turn", &plane), Ok(true));
    let below = it.add_plane("other", "pole", &plane);
    assert_eq!(code(below), ErrorType::OperationInvalidNode);
    let nodes = it.get_all_node_information().expect("all nodes");
    let sign = nodes.iter().find(|node| node.id == "sign").expect("a node");
    assert_eq!(
        (sign.parent_id.as_str(), sign.n_type),
        ("turn", NodeType::Plane)
    );
    assert_eq!(it.set_scale("pole", 1.0, 2.0, 3.0), Ok(true));
    let moved = Plane3D {
        px: 5.0,
        ..Plane3D::default()
    };
    assert_eq!(it.set_plane("sign", &moved), Ok(true));
    assert_eq!(it.move_node("turn", "world"), Ok(true));
    assert_eq!(it.remove_node("turn"), Ok(true));
    let gone = it.remove_node("sign");
    assert_eq!(code(gone), ErrorType::NonExistingNode);
}

fn move_and_measure(it: &mut InnerModelManagerClient) {
    assert_eq!(it.set_pose("root", "bowl", &at(1.0, 2000.0, 3.0)), Ok(true));
    let (_, there) = it.get_pose("root", "bowl").expect("a pose");
    assert!((there.x - 1.0).abs() < 1e-3 && (there.y - 2000.0).abs() < 1e-3);
    assert_eq!(
        it.set_pose_from_parent("bowl", &at(0.0, 740.0, 0.0)),
        Ok(true)
    );
    let (_, there) = it.get_pose_from_parent("bowl").expect("a pose");
    assert_eq!(there, at(0.0, 740.0, 0.0));
    let origin = Coord3D::default();
    let (_, there) = it.transform("root", "bowl", &origin).expect("a point");
    assert_eq!([there.x, there.y, there.z], [2500.0, 740.0, 800.0]);
    let matrix = it.get_transformation_matrix("root", "bowl");
    let matrix = matrix.expect("a matrix");
    assert_eq!([matrix.data[3], matrix.data[7]], [2500.0, 740.0]);
    for (item, base) in [("far", "root"), ("farther", "far")] {
        let pose = at(3e38, 0.0, 0.0);
        assert_eq!(it.add_transform(item, "static", base, &pose), Ok(true));
    }
    let too_far = it.get_pose("root", "farther");
    assert_eq!(code(too_far), ErrorType::InternalError);
    assert_eq!(it.remove_node("far"), Ok(true));
    assert_eq!(it.collide("bowl", "dining_top"), Ok(true));
    assert_eq!(it.collide("bowl", "bed"), Ok(false));
}

fn attributes(it: &mut InnerModelManagerClient) {
    let missing = it.get_attribute("bowl", "content");
    assert_eq!(code(missing), ErrorType::NonExistingAttribute);
    let added = it.add_attribute("bowl", "content", "string", "soup");
    assert_eq!(added, Ok(true));
    let again = it.add_attribute("bowl", "content", "string", "soup");
    assert_eq!(code(again), ErrorType::AttributeAlreadyExists);
    let set = it.set_attribute("bowl", "content", "string", "rice");
    assert_eq!(set, Ok(true));
    let found = it.get_attribute("bowl", "content");
    assert_eq!(found, Ok((true, "string".to_owned(), "rice".to_owned())));
    assert_eq!(it.remove_attribute("bowl", "content"), Ok(true));
}
