//! A client of the component `interop`, in the process of the test.

use crate::network::dds::{Domain, Over};
use rc_middleware::typed::{Operation, TypedClient};
use rc_middleware::{
    Address, Backend, CallError, Cdr, Endpoint, Environment, ExternalType, Qos, Reader, Settings,
    TypeIdentity, WakeEvent,
};
use rc_test_site::site::Site;
use std::time::Duration;

/// The generated description, for the types of its slots.
const DESCRIPTION: &str =
    include_str!("../../../../components/interop/generated/src/description.rs");
/// The slot that is called.
const SLOT: &str = "Interop";

/// Longest call. Errors are expected long before.
pub(crate) const PATIENCE: Duration = Duration::from_secs(10);

pub(crate) struct InteropClient {
    caller: TypedClient,
    _backend: Box<dyn Backend>,
}

impl InteropClient {
    pub(crate) const NOTE: Operation = Self::operation("note", -900_475_222, false);
    pub(crate) const NOTED: Operation = Self::operation("noted", 1_175_885_854, true);
    pub(crate) const CONSULT: Operation = Self::operation("consult", 3_440_400, true);
    pub(crate) const ADD: Operation = Self::operation("add", -59_184_076, true);

    /// Without type hashes, as another program.
    const fn operation(name: &'static str, id: i32, two_way: bool) -> Operation {
        Operation {
            name,
            id,
            type_hash: 0,
            two_way,
            replies: &[],
        }
    }

    /// Joins the domain, with further settings, and waits until the component is discovered.
    /// `types` are the types of the operations in ROS 2.
    pub(crate) fn meet(
        domain: &Domain,
        name: &str,
        more: &[(&str, &str)],
        types: &[(Operation, &str)],
    ) -> Self {
        let middleware = domain.over.name();
        let mut settings = Settings::default();
        let id = domain.id.to_string();
        let own = [("domain", id.as_str()), ("interfaces", "lo")];
        for (key, value) in own.iter().chain(more) {
            let known = rc_vocabulary::key(middleware, key).expect("a key");
            let value = known.kind.parse(value).expect("a value");
            settings.set(middleware, key, value);
        }
        let environment = Environment {
            network: domain.site.network.clone(),
            instance: name.to_owned(),
            directory: domain.site.directory(),
            wake_event: WakeEvent::new().expect("a wake event"),
            settings,
        };
        let backend = match domain.over {
            Over::Dds => rc_dds::connect(&environment),
            Over::Ros2 => rc_ros2::connect(&environment, &[]),
        };
        let backend = backend.expect("the domain");
        let address = format!("{}/{SLOT}", domain.site.network);
        let (_, described) = DESCRIPTION
            .split_once(&format!("const SLOT_{}", SLOT.to_uppercase()))
            .expect("the slot");
        let (_, hash) = described.split_once("type_hash: 0x").expect("its hash");
        let endpoint = Endpoint {
            address: Address::parse(&address).expect("an address"),
            types: TypeIdentity {
                name: format!("Rc{SLOT}::{SLOT}"),
                hash: u64::from_str_radix(&hash[..16], 16).expect("a hash"),
            },
            qos: Qos::CALL,
            external_types: types
                .iter()
                .map(|(operation, type_name)| ExternalType {
                    slot: SLOT.to_owned(),
                    operation: operation.name.to_owned(),
                    id: operation.id,
                    type_name: (*type_name).to_owned(),
                })
                .collect(),
        };
        let client = backend.client(&endpoint).expect("a client");
        Site::until("the component is found", || client.peers() == 1);
        Self {
            caller: TypedClient::new(client, PATIENCE),
            _backend: backend,
        }
    }

    pub(crate) fn add(&mut self, a: i64, b: i64) -> Result<i64, CallError> {
        self.caller.call_with(
            &Self::ADD,
            |writer| {
                writer.put(&a);
                writer.put(&b);
            },
            result,
        )
    }

    pub(crate) fn note(&mut self, text: &str) {
        self.caller
            .send_with(&Self::NOTE, |writer| writer.put(&text.to_owned()))
            .expect("to note");
    }

    pub(crate) fn noted(&mut self) -> Vec<String> {
        self.caller
            .call_with(&Self::NOTED, |writer| writer.put(&0_u8), result)
            .expect("the notes")
    }

    /// Lets the component call the oracle, for at most `limit`.
    pub(crate) fn consult(&mut self, question: &str, limit: Duration) -> Result<String, CallError> {
        self.caller.call_with(
            &Self::CONSULT,
            |writer| {
                writer.put(&question.to_owned());
                writer.put(&(limit.as_millis() as i32));
            },
            result,
        )
    }
}

/// Reads a result.
fn result<T: Cdr>(case: i32, reader: &mut Reader<'_>) -> Result<T, CallError> {
    assert_eq!(case, 0);
    Ok(reader.get()?)
}
