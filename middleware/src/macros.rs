//! Implementations that are equal for all structures: generated code names the structure and its
//! members.

/// Implements [`Cdr`](crate::Cdr) for a structure: its members in their order.
///
/// ```
/// use rc_middleware::{Cdr, Reader, Writer};
///
/// #[derive(Clone, Debug, PartialEq)]
/// struct Point {
///     x: f32,
///     name: String,
/// }
/// rc_middleware::cdr_struct!(Point: x, name);
///
/// let point = Point { x: 1.0, name: "a".to_owned() };
/// let mut writer = Writer::default();
/// writer.put(&point);
/// assert_eq!(Reader::new(&writer.into_bytes()).get(), Ok(point));
/// ```
#[macro_export]
macro_rules! cdr_struct {
    ($name:ident: $($member:ident),+ $(,)?) => {
        impl $crate::Cdr for $name {
            fn encode(&self, writer: &mut $crate::Writer<'_>) {
                $(writer.put(&self.$member);)+
            }

            fn decode(
                reader: &mut $crate::Reader<'_>,
            ) -> ::std::result::Result<Self, $crate::DecodeError> {
                ::std::result::Result::Ok(Self { $($member: reader.get()?),+ })
            }
        }
    };
}

/// Implements [`Cdr`](crate::Cdr) for an enumeration of these values: an int32 on the wire.
///
/// ```
/// use rc_middleware::{DecodeError, Reader, Writer};
///
/// #[derive(Clone, Copy, Debug, PartialEq)]
/// enum Voice {
///     Low = 0,
///     High = 7,
/// }
/// rc_middleware::cdr_enum!(Voice: Low, High);
///
/// let mut writer = Writer::default();
/// writer.put(&Voice::High);
/// let bytes = writer.into_bytes();
/// assert_eq!(bytes, [7, 0, 0, 0]);
/// assert_eq!(Reader::new(&bytes).get(), Ok(Voice::High));
/// let unknown = DecodeError::NoSuchValue { what: "Voice", value: 1 };
/// assert_eq!(Reader::new(&[1, 0, 0, 0]).get::<Voice>(), Err(unknown));
/// ```
#[macro_export]
macro_rules! cdr_enum {
    ($name:ident: $($value:ident),+ $(,)?) => {
        impl $crate::Cdr for $name {
            fn encode(&self, writer: &mut $crate::Writer<'_>) {
                writer.put(&(*self as i32));
            }

            fn decode(
                reader: &mut $crate::Reader<'_>,
            ) -> ::std::result::Result<Self, $crate::DecodeError> {
                match reader.get::<i32>()? {
                    $(number if number == Self::$value as i32 => ::std::result::Result::Ok(Self::$value),)+
                    number => ::std::result::Result::Err($crate::DecodeError::NoSuchValue {
                        what: ::std::stringify!($name),
                        value: i64::from(number),
                    }),
                }
            }
        }
    };
}

/// Makes a structure an error whose text is that of [`Debug`]: an exception of the IDSL.
#[macro_export]
macro_rules! exception {
    ($name:ident) => {
        impl ::std::fmt::Display for $name {
            fn fmt(&self, f: &mut ::std::fmt::Formatter<'_>) -> ::std::fmt::Result {
                ::std::write!(f, "{self:?}")
            }
        }

        impl ::std::error::Error for $name {}
    };
}

/// Implements [`InPlace`](crate::InPlace) for a structure whose members have the trait: the second
/// name is that of the type that owns its values.
///
/// ```
/// use rc_middleware::InPlace;
///
/// #[derive(Clone, Debug, PartialEq)]
/// struct Point {
///     x: f32,
///     y: f32,
/// }
/// rc_middleware::cdr_struct!(Point: x, y);
///
/// #[derive(
///     rc_middleware::in_place::FromBytes, rc_middleware::in_place::Immutable,
///     rc_middleware::in_place::IntoBytes, rc_middleware::in_place::KnownLayout,
/// )]
/// #[zerocopy(crate = "rc_middleware::in_place::zerocopy")]
/// #[repr(C)]
/// struct PointInPlace {
///     x: f32,
///     y: f32,
/// }
/// rc_middleware::in_place_struct!(PointInPlace for Point: x, y);
///
/// let mut place = PointInPlace { x: 1.0, y: 2.0 };
/// assert_eq!(place.value(), Ok(Point { x: 1.0, y: 2.0 }));
/// place.reset();
/// assert_eq!(place.value(), Ok(Point { x: 0.0, y: 0.0 }));
/// ```
#[macro_export]
macro_rules! in_place_struct {
    ($name:ident for $value:ident: $($member:ident),+ $(,)?) => {
        impl $crate::InPlace for $name {
            type Value = $value;

            const NAME: &'static str = ::std::stringify!($value);

            fn reset(&mut self) {
                $($crate::InPlace::reset(&mut self.$member);)+
            }

            fn set(&mut self, value: &$value) -> ::std::result::Result<(), $crate::EncodeError> {
                $($crate::InPlace::set(&mut self.$member, &value.$member)?;)+
                ::std::result::Result::Ok(())
            }

            fn value(&self) -> ::std::result::Result<$value, $crate::DecodeError> {
                ::std::result::Result::Ok($value {
                    $($member: $crate::InPlace::value(&self.$member)?),+
                })
            }
        }
    };
}

/// Declares the error of the operations that throw the same exceptions, each with the constant that
/// identifies it on the wire.
///
/// ```
/// # use rc_middleware::CallError;
/// #[derive(Clone, Debug, Default, PartialEq)]
/// pub struct Full {
///     what: String,
/// }
/// # impl std::fmt::Display for Full {
/// #     fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
/// #         f.write_str(&self.what)
/// #     }
/// # }
/// rc_middleware::cdr_struct!(Full: what);
///
/// const FULL: i32 = 7;
/// rc_middleware::call_error!(FullOrCall: Full(Full) = FULL; PutError "put");
///
/// let error: PutError = FullOrCall::from(Full { what: "no room".to_owned() });
/// assert_eq!(error.to_string(), "no room");
/// assert!(matches!(FullOrCall::from(CallError::Stopping), FullOrCall::Call(_)));
/// ```
#[macro_export]
macro_rules! call_error {
    (
        $name:ident: $($variant:ident($exception:ty) = $case:expr),+ $(,)?;
        $($alias:ident $operation:literal),+ $(,)?
    ) => {
        $(
            #[doc = ::std::concat!("The errors of `", $operation, "`.")]
            pub type $alias = $name;
        )+

        /// An error of the operations that throw these exceptions.
        #[derive(Clone, Debug, PartialEq)]
        pub enum $name {
            $(
                #[doc = ::std::concat!("The server threw the exception `", ::std::stringify!($variant), "`.")]
                $variant($exception),
            )+
            /// The call brought no reply.
            Call($crate::CallError),
        }

        impl ::std::fmt::Display for $name {
            fn fmt(&self, f: &mut ::std::fmt::Formatter<'_>) -> ::std::fmt::Result {
                match self {
                    $(Self::$variant(error) => ::std::fmt::Display::fmt(error, f),)+
                    Self::Call(error) => ::std::fmt::Display::fmt(error, f),
                }
            }
        }

        impl ::std::error::Error for $name {}

        impl ::std::convert::From<$crate::CallError> for $name {
            fn from(error: $crate::CallError) -> Self {
                Self::Call(error)
            }
        }

        impl ::std::convert::From<$crate::DecodeError> for $name {
            fn from(error: $crate::DecodeError) -> Self {
                Self::Call(error.into())
            }
        }

        $(
            impl ::std::convert::From<$exception> for $name {
                fn from(error: $exception) -> Self {
                    Self::$variant(error)
                }
            }
        )+

        impl $crate::typed::Throws for $name {
            fn read(
                case: i32,
                reader: &mut $crate::Reader<'_>,
            ) -> ::std::result::Result<Self, $crate::DecodeError> {
                match case {
                    $(case if case == $case => {
                        $crate::typed::result(reader).map(Self::$variant)
                    })+
                    _ => ::std::result::Result::Err($crate::DecodeError::Unknown(
                        "exception in the reply",
                    )),
                }
            }

            fn refuse(
                self,
                request: &mut $crate::typed::Request<'_>,
            ) -> ::std::result::Result<(), $crate::typed::HandlerError> {
                match self {
                    $(Self::$variant(error) => request.throw($case, error),)+
                    Self::Call(error) => request.fail(&error),
                }
            }
        }
    };
}

/// Declares a client of an interface. Generated code adds its operations.
///
/// ```
/// use rc_middleware::typed::{Operation, TypedClient};
/// use rc_middleware::{CallError, Client, Header, RequestBody};
/// use std::time::Duration;
///
/// const STOP: Operation = Operation::one_way("stop", 7, 0);
/// rc_middleware::client!(BaseClient);
///
/// impl BaseClient {
///     /// Stops the base.
///     pub fn stop(&mut self) -> Result<(), CallError> {
///         self.client.send(&STOP, ())
///     }
/// }
///
/// /// The port of a client whose server is not there.
/// struct Alone;
///
/// impl Client for Alone {
///     // …
/// #     fn guid(&self) -> [u8; 16] {
/// #         [1; 16]
/// #     }
/// #     fn peers(&self) -> usize {
/// #         0
/// #     }
/// #     fn call(
/// #         &mut self,
/// #         _: Header,
/// #         _: &dyn RequestBody,
/// #         _: Duration,
/// #         _: &mut dyn FnMut(Header, &[u8]),
/// #     ) -> Result<(), CallError> {
/// #         Err(CallError::NoServer("base".to_owned()))
/// #     }
/// #     fn start(&mut self, _: Header, _: &dyn RequestBody, _: Duration) -> Result<(), CallError> {
/// #         Err(CallError::NoServer("base".to_owned()))
/// #     }
/// #     fn poll(
/// #         &mut self,
/// #         _: &mut dyn FnMut(u64, Header, &[u8]),
/// #     ) -> Option<(u64, Result<(), CallError>)> {
/// #         None
/// #     }
/// #     fn forget(&mut self, _: u64) {}
///     fn send(&mut self, _: Header, _: &dyn RequestBody) -> Result<(), CallError> {
///         Err(CallError::NoServer("base".to_owned()))
///     }
/// }
///
/// let mut base = BaseClient::new(TypedClient::new(Box::new(Alone), Duration::from_secs(1)));
/// assert!(!base.is_connected());
/// assert_eq!(base.stop(), Err(CallError::NoServer("base".to_owned())));
/// ```
#[macro_export]
macro_rules! client {
    ($name:ident) => {
        /// A client of the interface.
        pub struct $name {
            client: $crate::typed::TypedClient,
        }

        impl $name {
            /// Calls the operations through `client`.
            pub fn new(client: $crate::typed::TypedClient) -> Self {
                Self { client }
            }

            /// Sets the longest time that a call may take.
            pub fn set_timeout(&mut self, timeout: ::std::time::Duration) {
                self.client.set_timeout(timeout);
            }

            /// Whether there is a server.
            pub fn is_connected(&self) -> bool {
                self.client.peers() > 0
            }

            /// The age of the last reply, and what it is made of, if the slot has `fresh` or
            /// `cache`.
            pub fn freshness(&self) -> ::std::option::Option<$crate::Freshness> {
                self.client.freshness()
            }

            /// Calls by operations, for generated code.
            #[doc(hidden)]
            pub fn rc_typed(&mut self) -> &mut $crate::typed::TypedClient {
                &mut self.client
            }
        }
    };
}

/// Declares the client of an asynchronous slot: one of [`client!`], `base`, with a function `take` for
/// results that were left. Generated code adds functions that start queries.
///
/// ```
/// # use rc_middleware::typed::TypedClient;
/// rc_middleware::client!(BaseClient);
/// rc_middleware::async_client!(BaseAsyncClient over BaseClient, take);
///
/// fn is_connected(client: &BaseAsyncClient) -> bool {
///     client.is_connected()
/// }
/// ```
#[macro_export]
macro_rules! async_client {
    ($name:ident over $base:ty, $take:ident) => {
        /// Calls operations and waits for their replies, or starts queries, which end later.
        pub struct $name(pub(crate) $base);

        impl $name {
            /// Calls through `client`.
            pub fn new(client: $crate::typed::TypedClient) -> Self {
                Self(<$base>::new(client))
            }

            /// The result of a call that has ended, once. `None` if it has not ended, or if the
            /// worker has handled its end.
            pub fn $take<R: 'static, E: 'static>(
                &mut self,
                call: &$crate::typed::Call<R, E>,
            ) -> ::std::option::Option<::std::result::Result<R, E>> {
                self.0.rc_typed().take(call)
            }
        }

        impl ::std::ops::Deref for $name {
            type Target = $base;

            fn deref(&self) -> &$base {
                &self.0
            }
        }

        impl ::std::ops::DerefMut for $name {
            fn deref_mut(&mut self) -> &mut $base {
                &mut self.0
            }
        }
    };
}

/// Declares a publisher of an interface with these topics. Generated code adds functions that
/// publish.
///
/// ```
/// use rc_middleware::typed::{Operation, TypedPublisher};
/// use rc_middleware::{Header, Publisher, SendError};
///
/// const TOPICS: [Operation; 2] = [Operation::one_way("near", 1, 0), Operation::one_way("far", 2, 0)];
/// rc_middleware::publisher!(RangePublisher: near, far);
///
/// impl RangePublisher {
///     /// Publishes a near range in m.
///     pub fn near(&mut self, range: f32) -> Result<(), SendError> {
///         self.near.publish_with(|writer| writer.put(&range))
///     }
/// }
///
/// /// The port of a publisher with three subscribers.
/// struct Port;
///
/// impl Publisher for Port {
///     fn publish(&mut self, _: Header, _: &[u8]) -> Result<(), SendError> {
///         Ok(())
///     }
///
///     fn peers(&self) -> usize {
///         3
///     }
/// }
///
/// let open = |topic: usize| Ok(TypedPublisher::new(Box::new(Port), TOPICS[topic]));
/// let mut ranges = RangePublisher::new(open).expect("both topics open");
/// assert_eq!(ranges.near(0.5), Ok(()));
/// assert_eq!(ranges.subscribers(), 3);
/// ```
#[macro_export]
macro_rules! publisher {
    ($name:ident: $($topic:ident),+ $(,)?) => {
        /// A publisher of the interface: each operation is a topic.
        pub struct $name {
            $($topic: $crate::typed::TypedPublisher,)+
        }

        impl $name {
            /// Publishes each topic through the publisher that `open` returns for its number,
            /// from 0.
            ///
            /// # Errors
            /// The list of `open`.
            pub fn new(
                mut open: impl ::std::ops::FnMut(usize) -> ::std::result::Result<
                    $crate::typed::TypedPublisher,
                    $crate::OpenError,
                >,
            ) -> ::std::result::Result<Self, $crate::OpenError> {
                let mut next = 0_usize..;
                let mut open = || open(next.next().unwrap_or_default());
                ::std::result::Result::Ok(Self { $($topic: open()?),+ })
            }

            /// The topic with this number, from 0, for libraries that serialize its samples.
            #[doc(hidden)]
            pub fn rc_topic(
                &mut self,
                number: usize,
            ) -> ::std::option::Option<&mut $crate::typed::TypedPublisher> {
                [$(&mut self.$topic),+].into_iter().nth(number)
            }

            /// The number of subscribers of the topic that has most.
            pub fn subscribers(&self) -> usize {
                [$(self.$topic.peers()),+].into_iter().max().unwrap_or(0)
            }
        }
    };
}
