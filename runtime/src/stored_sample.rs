//! The body of a sample that a component keeps.

use crate::component::Body;
use rc_middleware::shared_value::{HeldValue, SharedValue};
use rc_middleware::{DecodeError, Encoding, Reader};

/// A body that may be read several times.
#[derive(Clone, Debug)]
pub(crate) enum StoredSample {
    Bytes(Encoding, Vec<u8>),
    /// From a publisher in this process, not encoded.
    Value(SharedValue),
}

impl StoredSample {
    /// Keeps a body. The memory of an earlier one may serve again.
    pub(crate) fn of(encoding: Encoding, body: &Body<'_>, earlier: Option<Self>) -> Self {
        if let Body::Value(value) = body
            && let Some(value) = value.shared()
        {
            return Self::Value(value);
        }
        let mut bytes = match earlier {
            Some(Self::Bytes(_, bytes)) => bytes,
            _ => Vec::new(),
        };
        bytes.clear();
        bytes.extend_from_slice(body.memory());
        Self::Bytes(encoding, bytes)
    }

    /// The memory that it takes, in bytes.
    pub(crate) fn size(&self) -> usize {
        match self {
            Self::Bytes(_, bytes) => bytes.len(),
            Self::Value(value) => value.memory(),
        }
    }

    /// The value, which `read` reads.
    pub(crate) fn read<T>(
        &self,
        read: impl FnOnce(&mut Reader<'_>) -> Result<T, DecodeError>,
    ) -> Result<T, DecodeError> {
        match self {
            Self::Bytes(encoding, bytes) => read(&mut Reader::of(bytes, *encoding)),
            Self::Value(value) => read(&mut HeldValue::from(value.clone()).reader()),
        }
    }
}
