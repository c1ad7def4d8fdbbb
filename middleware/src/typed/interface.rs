//! The code of an interface over the list of its operations. Generated code declares the list once,
//! as a macro `interface!` of the interface's module, and hands it to each of these macros:
//!
//! ```text
//! /// Documentation of the handlers.
//! Base ServeBase ReceiveBase, BaseMembers ServeBaseMembers ReceiveBaseMembers;
//! /// Documentation of the operation.
//! fn set_speed(speed: f32) {
//!     SET_SPEED.command(typed::read)
//!     SetSpeed on_set_speed one_way("setSpeed", 7, 0x2a)
//! }
//! ```
//!
//! - The first line names the traits of handlers, and the traits that serve and receive, for a slot
//!   and for the members of a slot array.
//! - An operation has the signature of its handler without receiver and context. It has no brackets
//!   if there are no parameters; a reply that is written in place is `into(result: &mut T)`.
//! - The first line of its body has its constant and the function of [`Request`](super::Request) that
//!   serves it, with the codecs that this function takes.
//! - The second line has the names of fakes, and the arguments of the constant: a constructor of
//!   [`Operation`](super::Operation), which begins with the name in the IDSL. The list of handlers
//!   with values in place, which have the same constants, has no such line.

/// Declares the constants of the operations, and `OPERATIONS`.
///
/// ```
/// use rc_middleware::typed;
///
/// macro_rules! interface {
///     ($($what:tt)+) => {
///         $($what)+! {
///             /// The handlers of `Base`.
///             Base ServeBase ReceiveBase, BaseMembers ServeBaseMembers ReceiveBaseMembers;
///             /// Drives on with this speed.
///             fn set_speed(speed: f32) {
///                 SET_SPEED.command(typed::read)
///                 SetSpeed on_set_speed one_way("setSpeed", 7, 0x2a)
///             }
///             /// The speed.
///             fn speed -> f32 {
///                 SPEED.answer(typed::read, typed::reply)
///                 Speed on_speed query("speed", 8, 0x2b, &[])
///             }
///         }
///     };
/// }
/// interface!(rc_middleware::operations);
/// interface!(rc_middleware::handlers);
/// interface!(rc_middleware::serve);
///
/// struct Worker(f32);
///
/// impl Base<()> for Worker {
///     fn set_speed(&mut self, _: &mut (), speed: f32) {
///         self.0 = speed;
///     }
///
///     fn speed(&mut self, _: &mut ()) -> f32 {
///         self.0
///     }
/// }
///
/// fn serves(_: impl ServeBase<()>) {}
/// serves(Worker(0.0));
/// assert_eq!(OPERATIONS, [SET_SPEED, SPEED]);
/// assert!(SPEED.two_way);
/// ```
#[macro_export]
macro_rules! operations {
    (
        $(#[$about:meta])*
        $single:ident $serve:ident $receive:ident, $members:ident $serve_member:ident $receive_member:ident;
        $(
            $(#[$doc:meta])*
            fn $method:ident $(($($arg:ident: $ty:ty),+ $(,)?))? $(-> $ret:ty)? {
                $operation:ident.$how:ident($($codec:expr),* $(,)?)
                $call:ident $on:ident $kind:ident($name:literal $(, $fact:expr)* $(,)?)
            }
        )*
    ) => {
        $(
            #[doc = ::std::concat!("`", $name, "`")]
            pub const $operation: $crate::typed::Operation =
                $crate::typed::Operation::$kind($name $(, $fact)*);
        )*

        /// All operations, in the order of the IDSL.
        pub const OPERATIONS: &[$crate::typed::Operation] = &[$($operation),*];
    };
}

/// Declares the traits of handlers: of a slot, and of the members of a slot array. See
/// [`operations!`](crate::operations) for an example.
#[macro_export]
macro_rules! handlers {
    (
        $(#[$about:meta])*
        $single:ident $serve:ident $receive:ident, $members:ident $serve_member:ident $receive_member:ident;
        $(
            $(#[$doc:meta])*
            fn $method:ident $(($($arg:ident: $ty:ty),+ $(,)?))? $(into($out:ident: $out_ty:ty))? $(-> $ret:ty)? {
                $operation:ident.$how:ident($($codec:expr),* $(,)?) $($fake:tt)*
            }
        )*
    ) => {
        $(#[$about])*
        ///
        /// `C` is the context of the worker. `S` distinguishes slots of one interface.
        pub trait $single<C, S = ()> {
            $(
                $(#[$doc])*
                fn $method(&mut self, ctx: &mut C $($(, $arg: $ty)+)? $(, $out: $out_ty)?) $(-> $ret)?;
            )*
        }

        $(#[$about])*
        ///
        /// They handle the members of a slot array. `C` is the context of the worker. `S`
        /// distinguishes slots of one interface.
        pub trait $members<C, S = ()> {
            $(
                $(#[$doc])*
                fn $method(
                    &mut self,
                    ctx: &mut C,
                    member: &$crate::Member $($(, $arg: $ty)+)? $(, $out: $out_ty)?
                ) $(-> $ret)?;
            )*
        }
    };
}

/// Declares the traits that answer the requests of a slot, and of the members of a slot array. Each
/// implementor of the handlers has them. See [`operations!`](crate::operations) for an example.
#[macro_export]
macro_rules! serve {
    (
        $(#[$about:meta])*
        $single:ident $serve:ident $receive:ident, $members:ident $serve_member:ident $receive_member:ident;
        $(
            $(#[$doc:meta])*
            fn $method:ident $(($($arg:ident: $ty:ty),+ $(,)?))? $(into($out:ident: $out_ty:ty))? $(-> $ret:ty)? {
                $operation:ident.$how:ident($($codec:expr),* $(,)?) $($fake:tt)*
            }
        )*
    ) => {
        #[doc = ::std::concat!(
            "Answers the requests of a slot. Each implementor of [`", ::std::stringify!($single),
            "`] has this trait. A worker may implement it directly, and let a value answer."
        )]
        pub trait $serve<C, S = ()> {
            /// Answers one request.
            fn serve(
                &mut self,
                ctx: &mut C,
                request: &mut $crate::typed::Request<'_>,
            ) -> ::std::result::Result<(), $crate::typed::HandlerError>;
        }

        impl<C, S, W: $single<C, S>> $serve<C, S> for W {
            fn serve(
                &mut self,
                ctx: &mut C,
                request: &mut $crate::typed::Request<'_>,
            ) -> ::std::result::Result<(), $crate::typed::HandlerError> {
                $(
                    if request.operation == $operation.id {
                        return request.$how(
                            &$operation,
                            $($codec,)*
                            |($($($arg,)+)?) $(, $out: $out_ty)?| {
                                <W as $single<C, S>>::$method(self, ctx $($(, $arg)+)? $(, $out)?)
                            },
                        );
                    }
                )*
                request.unknown()
            }
        }

        #[doc = ::std::concat!(
            "Answers the requests to the members of a slot array. Each implementor of [`",
            ::std::stringify!($members),
            "`] has this trait. A worker may implement it directly, and let a value answer."
        )]
        pub trait $serve_member<C, S = ()> {
            /// Answers one request.
            fn serve(
                &mut self,
                ctx: &mut C,
                member: &$crate::Member,
                request: &mut $crate::typed::Request<'_>,
            ) -> ::std::result::Result<(), $crate::typed::HandlerError>;
        }

        impl<C, S, W: $members<C, S>> $serve_member<C, S> for W {
            fn serve(
                &mut self,
                ctx: &mut C,
                member: &$crate::Member,
                request: &mut $crate::typed::Request<'_>,
            ) -> ::std::result::Result<(), $crate::typed::HandlerError> {
                $(
                    if request.operation == $operation.id {
                        return request.$how(
                            &$operation,
                            $($codec,)*
                            |($($($arg,)+)?) $(, $out: $out_ty)?| {
                                <W as $members<C, S>>::$method(
                                    self, ctx, member $($(, $arg)+)? $(, $out)?
                                )
                            },
                        );
                    }
                )*
                request.unknown()
            }
        }
    };
}

/// Declares the traits that take the samples of a slot, and of the members of a slot array. Each
/// implementor of the handlers has them. [`Sample`](super::Sample) has the functions that the list
/// names.
///
/// ```
/// use rc_middleware::typed;
///
/// macro_rules! interface {
///     ($($what:tt)+) => {
///         $($what)+! {
///             /// The handlers of `Ticks`.
///             Ticks ServeTicks ReceiveTicks, TicksMembers ServeTicksMembers ReceiveTicksMembers;
///             fn tick(number: i64) {
///                 TICK.command(typed::read)
///                 Tick on_tick one_way("tick", 7, 0x2a)
///             }
///         }
///     };
/// }
/// interface!(rc_middleware::operations);
/// interface!(rc_middleware::handlers);
/// interface!(rc_middleware::receive);
///
/// struct Worker(i64);
///
/// impl Ticks<()> for Worker {
///     fn tick(&mut self, _: &mut (), number: i64) {
///         self.0 = number;
///     }
/// }
///
/// let mut worker = Worker(0);
/// let sample = 42_i64.to_le_bytes();
/// worker.receive(&mut (), 0, &mut rc_middleware::Reader::new(&sample)).expect("a sample");
/// assert_eq!(worker.0, 42);
/// ```
#[macro_export]
macro_rules! receive {
    (
        $(#[$about:meta])*
        $single:ident $serve:ident $receive:ident, $members:ident $serve_member:ident $receive_member:ident;
        $(
            $(#[$doc:meta])*
            fn $method:ident $(($($arg:ident: $ty:ty),+ $(,)?))? {
                $operation:ident.$how:ident($codec:expr $(,)?) $($fake:tt)*
            }
        )*
    ) => {
        #[doc = ::std::concat!(
            "Takes the samples of a slot. Each implementor of [`", ::std::stringify!($single),
            "`] has this trait. A worker may implement it directly, and let a value take them."
        )]
        pub trait $receive<C, S = ()> {
            /// Takes one sample of the topic with this number.
            fn receive(
                &mut self,
                ctx: &mut C,
                topic: usize,
                reader: &mut $crate::Reader<'_>,
            ) -> ::std::result::Result<(), $crate::typed::HandlerError>;
        }

        impl<C, S, W: $single<C, S>> $receive<C, S> for W {
            fn receive(
                &mut self,
                ctx: &mut C,
                topic: usize,
                reader: &mut $crate::Reader<'_>,
            ) -> ::std::result::Result<(), $crate::typed::HandlerError> {
                let sample = $crate::typed::Sample::new(topic, &[$($operation),*], reader)?;
                $(
                    if sample.operation == $operation.id {
                        return sample.$how($codec, |($($($arg,)+)?)| {
                            <W as $single<C, S>>::$method(self, ctx $($(, $arg)+)?)
                        });
                    }
                )*
                sample.unknown()
            }
        }

        #[doc = ::std::concat!(
            "Takes the samples of the members of a slot array. Each implementor of [`",
            ::std::stringify!($members),
            "`] has this trait. A worker may implement it directly, and let a value take them."
        )]
        pub trait $receive_member<C, S = ()> {
            /// Takes one sample of the topic with this number.
            fn receive(
                &mut self,
                ctx: &mut C,
                member: &$crate::Member,
                topic: usize,
                reader: &mut $crate::Reader<'_>,
            ) -> ::std::result::Result<(), $crate::typed::HandlerError>;
        }

        impl<C, S, W: $members<C, S>> $receive_member<C, S> for W {
            fn receive(
                &mut self,
                ctx: &mut C,
                member: &$crate::Member,
                topic: usize,
                reader: &mut $crate::Reader<'_>,
            ) -> ::std::result::Result<(), $crate::typed::HandlerError> {
                let sample = $crate::typed::Sample::new(topic, &[$($operation),*], reader)?;
                $(
                    if sample.operation == $operation.id {
                        return sample.$how($codec, |($($($arg,)+)?)| {
                            <W as $members<C, S>>::$method(self, ctx, member $($(, $arg)+)?)
                        });
                    }
                )*
                sample.unknown()
            }
        }
    };
}
