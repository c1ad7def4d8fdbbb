//! A request on its way to a backend: bytes, or a value that is written straight into the memory of
//! the middleware.

use crate::cdr::EncodeError;
use crate::shared_value::{HeldValue, SharedValue};

/// The body of a request, which a backend copies or writes into its own memory.
pub trait RequestBody {
    /// Length in bytes.
    fn length(&self) -> usize;

    /// The bytes at its begin; the envelope is complete.
    fn begin(&self) -> &[u8];

    /// Writes the body into `memory`, which has its length.
    fn write_into(&self, memory: &mut [u8]) -> Result<(), EncodeError>;

    /// The body as a value, for a server in this process: once.
    fn value(&self) -> Option<SharedValue> {
        None
    }
}

/// The body in a buffer, for a middleware that lends no memory.
pub fn buffer(request: &dyn RequestBody) -> Result<Vec<u8>, EncodeError> {
    let mut bytes = vec![0; request.length()];
    request.write_into(&mut bytes)?;
    Ok(bytes)
}

impl RequestBody for &[u8] {
    fn length(&self) -> usize {
        self.len()
    }

    fn begin(&self) -> &[u8] {
        self
    }

    fn write_into(&self, memory: &mut [u8]) -> Result<(), EncodeError> {
        if memory.len() != self.len() {
            return Err(EncodeError::Changed);
        }
        memory.copy_from_slice(self);
        Ok(())
    }
}

impl<const N: usize> RequestBody for [u8; N] {
    fn length(&self) -> usize {
        N
    }

    fn begin(&self) -> &[u8] {
        self
    }

    fn write_into(&self, memory: &mut [u8]) -> Result<(), EncodeError> {
        self.as_slice().write_into(memory)
    }
}

impl RequestBody for Vec<u8> {
    fn length(&self) -> usize {
        self.len()
    }

    fn begin(&self) -> &[u8] {
        self
    }

    fn write_into(&self, memory: &mut [u8]) -> Result<(), EncodeError> {
        self.as_slice().write_into(memory)
    }
}

/// A request whose large arrays are not in the buffer yet.
pub(crate) struct Written<'a, F> {
    /// Output of the first pass: the envelope, and the parameters without large arrays.
    pub(crate) begin: &'a [u8],
    pub(crate) length: usize,
    /// Writes the whole request.
    pub(crate) write: F,
}

impl<F: Fn(&mut [u8]) -> Result<(), EncodeError>> RequestBody for Written<'_, F> {
    fn length(&self) -> usize {
        self.length
    }

    fn begin(&self) -> &[u8] {
        self.begin
    }

    fn write_into(&self, memory: &mut [u8]) -> Result<(), EncodeError> {
        (self.write)(memory)
    }
}

/// A request that is sent as a value.
impl RequestBody for HeldValue {
    fn length(&self) -> usize {
        self.len()
    }

    fn begin(&self) -> &[u8] {
        self.envelope()
    }

    fn write_into(&self, memory: &mut [u8]) -> Result<(), EncodeError> {
        self.bytes().write_into(memory)
    }

    fn value(&self) -> Option<SharedValue> {
        self.share()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_body_of_bytes_is_written_whole() {
        fn written(body: &dyn RequestBody) -> Vec<u8> {
            assert_eq!(body.begin().len(), body.length());
            buffer(body).expect("a body")
        }
        assert_eq!(written(&[1, 2, 3].as_slice()), [1, 2, 3]);
        assert_eq!(written(&[4, 5]), [4, 5]);
        assert_eq!(written(&vec![6]), [6]);
        let short = [1, 2, 3].write_into(&mut [0; 2]);
        assert_eq!(short, Err(EncodeError::Changed));
    }
}
