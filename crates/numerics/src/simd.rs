//! Work for wide registers.

/// A function that is compiled twice, for any processor and for one whose registers hold four numbers (AVX2 with FMA), and
/// chooses as it runs. What it does is an inlined function of the same arguments; sums and products are made in the order
/// that it states by both, and rounded alike. `[...]` holds generic parameters.
#[macro_export]
macro_rules! wide {
    (
        $(#[$doc:meta])*
        $seen:vis fn $name:ident[$($generic:tt)*]($($arg:ident: $type:ty),* $(,)?) -> $returns:ty
        = $work:expr $(, else $plain:expr)?
    ) => {
        $(#[$doc])*
        $seen fn $name<$($generic)*>($($arg: $type),*) -> $returns {
            #[cfg(target_arch = "x86_64")]
            {
                #[target_feature(enable = "avx2,fma")]
                fn with_avx2<$($generic)*>($($arg: $type),*) -> $returns {
                    $work($($arg),*)
                }
                if std::arch::is_x86_feature_detected!("avx2")
                    && std::arch::is_x86_feature_detected!("fma")
                {
                    // SAFETY: the processor has both.
                    return unsafe { with_avx2($($arg),*) };
                }
            }
            $crate::last_of!($work $(, $plain)?)($($arg),*)
        }
    };
}

/// The last of what is given.
#[doc(hidden)]
#[macro_export]
macro_rules! last_of {
    ($work:expr) => {
        $work
    };
    ($work:expr, $plain:expr) => {
        $plain
    };
}
