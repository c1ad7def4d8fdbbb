//! Calls of a slot of a component in the process of the test, which a command for each would make
//! slow.

use rc_management::Client;
use rc_management::component::Request;
use rc_management::observation::{Called, Described};
use rc_middleware::rpc::{self, ReplyKind, RequestId};
use rc_middleware::{Reader, Writer};
use rc_test_site::site::Site;
use rc_values::description::Module;
use rc_values::{Catalog, Interface, decode_from, encode, from_json};
use serde_json::Value;
use std::sync::Arc;
use std::time::Duration;

/// The longest call. Each reply is expected long before.
const LIMIT: Duration = Duration::from_secs(20);

pub(crate) struct Caller {
    client: Client,
    slot: String,
    interface: Arc<Interface>,
}

impl Caller {
    pub(crate) fn new(site: &Site, component: &str, slot: &str) -> Self {
        let socket = site.directory().socket(component);
        let mut client = Client::connect(&socket, LIMIT).expect("its socket");
        let described: Described = client
            .call(&Request::Describe {}, LIMIT)
            .expect("a description");
        let modules: Vec<Module> = described
            .types
            .iter()
            .map(|module| serde_json::from_value(module.clone()).expect("a module"))
            .collect();
        let catalog = Catalog::new(&modules).expect("types");
        let of = described.slots.iter().find(|of| of.name == slot);
        let interface = catalog.interface(&of.expect("the slot").interface);
        Self {
            client,
            slot: slot.to_owned(),
            interface: Arc::clone(interface.expect("the interface")),
        }
    }

    /// The result of an operation: its output parameters, and the returned value as `return`.
    pub(crate) fn call(&mut self, operation: &str, parameters: &Value) -> Value {
        let result = self.try_call(operation, parameters);
        result.unwrap_or_else(|thrown| panic!("{operation} of {}: {thrown}", self.slot))
    }

    /// As [`Self::call`]. The error is an exception of the operation.
    pub(crate) fn try_call(&mut self, operation: &str, parameters: &Value) -> Result<Value, Value> {
        let of = self.interface.operation(operation).expect("an operation");
        let id = RequestId {
            writer: [0; 16],
            sequence: 1,
        };
        let mut writer = Writer::default();
        rpc::begin_request(&mut writer, id, of.id);
        let parameters = from_json(&of.request, parameters).expect("parameters");
        encode(&parameters, &mut writer).expect("parameters");
        let request = Request::Call {
            slot: self.slot.clone(),
            body: writer.into_bytes(),
            timeout_ms: 10_000,
        };
        let called: Called = self.client.call(&request, LIMIT).expect("a reply");
        let mut reader = Reader::new(&called.body);
        let (_, kind) = rpc::open_reply(&mut reader, of.id).expect("an envelope");
        let is_thrown = |id: i32| kind == ReplyKind::Case(id);
        if let Some(exception) = of.throws.iter().find(|exception| is_thrown(exception.id)) {
            let thrown = decode_from(&exception.ty, &mut reader).expect("an exception");
            return Err(serde_json::to_value(thrown).expect("JSON"));
        }
        assert_eq!(kind, ReplyKind::Case(0), "{operation} of {}", self.slot);
        let result = decode_from(&of.reply, &mut reader).expect("a result");
        Ok(serde_json::to_value(result).expect("JSON"))
    }
}
