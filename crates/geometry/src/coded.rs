//! Enums with a stable name for each variant.

/// Declares an enum by rows `Variant = "name"`, with the list of variants and the function for the
/// name.
macro_rules! coded {
    (
        $(#[$about:meta])*
        pub enum $enum:ident { $($(#[$what:meta])* $variant:ident = $name:literal,)* }
        $(#[$about_all:meta])*
        ALL
        $(#[$about_name:meta])*
        $function:ident
    ) => {
        $(#[$about])*
        pub enum $enum { $($(#[$what])* $variant,)* }

        impl $enum {
            $(#[$about_all])*
            pub const ALL: [Self; [$(Self::$variant),*].len()] = [$(Self::$variant),*];

            $(#[$about_name])*
            pub const fn $function(self) -> &'static str {
                match self {
                    $(Self::$variant => $name,)*
                }
            }
        }
    };
}

pub(crate) use coded;
