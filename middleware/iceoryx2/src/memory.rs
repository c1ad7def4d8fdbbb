//! Loans of shared memory that are written in place.
#![expect(
    unsafe_code,
    reason = "iceoryx2 loans uninitialised memory, and initialising it costs a copy"
)]

use crate::message::{MessageHeader, RequestHeader};
use crate::ports::{Request, Response, Sample, Service};
use iceoryx2::request_mut_uninit::RequestMutUninit;
use iceoryx2::response_mut_uninit::ResponseMutUninit;
use iceoryx2::sample_mut_uninit::SampleMutUninit;
use std::mem::MaybeUninit;

/// The loan of a sample, with its previous content.
pub(crate) fn sample(lent: SampleMutUninit<Service, [MaybeUninit<u8>], MessageHeader>) -> Sample {
    // SAFETY: bytes have no invalid values, and these are initialised: they lie in shared memory,
    // which the system hands out zeroed, and into which afterwards only bytes were written: copied
    // ones, or the fields of structures without padding (`rc_middleware::InPlace` requires
    // `zerocopy::IntoBytes`). No other process writes to a sample that is lent; receivers map it
    // for reading.
    unsafe { lent.assume_init() }
}

/// The loan of a reply, with its previous content.
pub(crate) fn response(
    lent: ResponseMutUninit<Service, [MaybeUninit<u8>], MessageHeader>,
) -> Response {
    // SAFETY: as for a sample.
    unsafe { lent.assume_init() }
}

/// The loan of a request, with its previous content.
pub(crate) fn request(
    lent: RequestMutUninit<Service, [MaybeUninit<u8>], RequestHeader, [u8], MessageHeader>,
) -> Request {
    // SAFETY: as for a sample.
    unsafe { lent.assume_init() }
}
