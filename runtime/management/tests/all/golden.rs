//! The text of messages, for comparison with `messages.txt`.

use rc_management::rpc;
use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::Value;
use std::fmt::Debug;

#[derive(Default)]
pub(crate) struct Golden(pub(crate) String);

impl Golden {
    pub(crate) fn title(&mut self, title: &str) {
        self.0.push_str(&format!("{title}\n"));
    }

    pub(crate) fn line(&mut self, line: &[u8]) {
        self.0
            .push_str(&format!("  {}", String::from_utf8_lossy(line)));
    }

    pub(crate) fn message<T>(&mut self, messages: impl IntoIterator<Item = T>)
    where
        T: Serialize + DeserializeOwned + PartialEq + Debug,
    {
        for message in messages {
            let line = rpc::notification(&message);
            let rpc::Call { method, params, .. } = rpc::Call::parse(&line).expect("a message");
            let read: T = rpc::message(&method, params).expect("the message");
            assert_eq!(read, message);
            self.line(&line);
        }
    }

    pub(crate) fn result<T: Serialize + DeserializeOwned + PartialEq + Debug>(
        &mut self,
        result: &T,
    ) {
        let line = rpc::answer(&Value::from(1), rpc::result(result));
        let mut answer: Value = serde_json::from_slice(&line).expect("JSON");
        let read: T = serde_json::from_value(answer["result"].take()).expect("the result");
        assert_eq!(&read, result);
        self.line(&line);
    }

    pub(crate) fn object<T: Serialize + DeserializeOwned + PartialEq + Debug>(
        &mut self,
        objects: impl IntoIterator<Item = T>,
    ) {
        for object in objects {
            let line = rc_management::lines::encode(&object);
            let read: T = serde_json::from_slice(&line).expect("the object");
            assert_eq!(read, object);
            self.line(&line);
        }
    }
}

pub(crate) fn text(text: &str) -> String {
    text.to_owned()
}
