//! The context of a worker under test, with the fake peers of a component.

/// Declares the `TestContext` of a component over its context, its description, the type of its
/// parameters if it has some, and its fake peers with the numbers of their slots. Generated code
/// calls it.
///
/// ```ignore
/// rc_runtime::test_context! {
///     Context, DESCRIPTION, Params;
///     /// The server of `Laser`.
///     laser: LaserFake = 0,
/// }
/// ```
#[macro_export]
macro_rules! test_context {
    (
        $context:ty, $description:expr $(, $params:ty)?;
        $($(#[$about:meta])* $field:ident: $fake:ty = $slot:expr,)*
    ) => {
        /// The context of a worker under test: a context whose peers are the fields of this
        /// structure. All functions of the worker take it as theirs;
        /// [`Bench`]($crate::testing::Bench) has those that drive the test.
        ///
        /// ```ignore
        /// let mut test = TestContext::configured()?;
        /// let mut worker = SpecificWorker::initialize(&mut test)?;
        /// worker.compute(&mut test)?;
        /// ```
        pub struct TestContext {
            $($(#[$about])* pub $field: $fake,)*
            bench_: $crate::testing::Bench<$context>,
        }

        impl TestContext {
            $crate::test_context!(@new $description $(, $params)?);

            /// A context with the parameters and the period of `etc/config.toml`, which is checked
            /// as when the component starts.
            pub fn configured() -> ::std::result::Result<Self, $crate::StartError> {
                $crate::testing::Bench::configured(&$description).map(Self::over)
            }

            fn over(bench: $crate::testing::Bench<$context>) -> Self {
                Self {
                    $($field: $crate::testing::Fake::new(bench.bed(), $slot, None),)*
                    bench_: bench,
                }
            }

            /// Answers every query that has no answer yet with default values.
            pub fn answer_defaults(&self) {
                $($crate::testing::Fake::answer_defaults(&self.$field);)*
            }
        }

        impl ::std::ops::Deref for TestContext {
            type Target = $crate::testing::Bench<$context>;

            fn deref(&self) -> &Self::Target {
                &self.bench_
            }
        }

        impl ::std::ops::DerefMut for TestContext {
            fn deref_mut(&mut self) -> &mut Self::Target {
                &mut self.bench_
            }
        }
    };
    (@new $description:expr, $params:ty) => {
        /// A context with these parameters.
        ///
        /// # Panics
        /// If the system has no descriptor left.
        pub fn new(params: $params) -> Self {
            let mut test = Self::over($crate::testing::Bench::without_configuration(&$description));
            test.params = params;
            test
        }
    };
    (@new $description:expr) => {
        /// A context.
        ///
        /// # Panics
        /// If the system has no descriptor left.
        #[allow(clippy::new_without_default, reason = "it may panic")]
        pub fn new() -> Self {
            Self::over($crate::testing::Bench::without_configuration(&$description))
        }
    };
}

/// Declares the function `embed_with_defaults` of a component, over its context, the trait of its
/// worker, and the calls of its fake servers with the numbers of their slots. Generated code calls it.
#[macro_export]
macro_rules! embed_with_defaults {
    ($context:ty, $handlers:path; $($slot:literal: $call:ty),+ $(,)?) => {
        /// Runs the whole component on a thread of this process, as `embed` does. A call that no
        /// server takes gets default values, and a slot without a server counts as connected.
        pub fn embed_with_defaults<W: $handlers>(
            args: &[&str],
        ) -> ::std::result::Result<$crate::Embedded, $crate::StartError> {
            const DEFAULTS: &[(usize, $crate::testing::DefaultReply)] =
                &[$(($slot, <$call as $crate::testing::FakeCall>::default_reply)),+];
            $crate::testing::embed_with_defaults::<W, $context>(DEFAULTS, args)
        }
    };
}
