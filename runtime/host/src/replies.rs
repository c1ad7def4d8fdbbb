//! Variants of replies whose types are known at run time.

use rc_middleware::typed::VariantCodec;
use rc_middleware::{DecodeError, EncodeError, Reader, Writer};
use rc_values::{Struct, ValueError, decode_from, default, encode};
use std::sync::Arc;

struct Variant(Arc<Struct>);

/// The codec of a structure.
pub(crate) fn codec(ty: &Arc<Struct>) -> &'static dyn VariantCodec {
    Box::leak(Box::new(Variant(Arc::clone(ty))))
}

impl VariantCodec for Variant {
    fn put(&self, writer: &mut Writer<'_>) {
        let written = default(&self.0).and_then(|value| encode(&value, writer));
        if let Err(error) = written {
            writer.fail(EncodeError::NoValue(error.to_string()));
        }
    }

    fn skip(&self, reader: &mut Reader<'_>) -> Result<(), DecodeError> {
        decode_from(&self.0, reader).map(drop).map_err(undecodable)
    }
}

/// A value that does not fit its type, as an error of decoding.
#[allow(clippy::needless_pass_by_value, reason = "a function for `map_err`")]
pub fn undecodable(error: ValueError) -> DecodeError {
    DecodeError::Invalid(EncodeError::NoValue(error.to_string()))
}
