//! Structures and numbers of V4L2 that this program uses; see README.md.

#![allow(
    non_camel_case_types,
    non_snake_case,
    non_upper_case_globals,
    reason = "the names are bindgen's, which others' code refers to"
)]

#[cfg(not(all(target_os = "linux", target_pointer_width = "64")))]
compile_error!(
    "these bindings are for 64-bit Linux; elsewhere, build without the feature `live`, and on \
     32-bit Linux without `nokhwa`, too"
);

#[cfg(all(target_os = "linux", target_pointer_width = "64"))]
mod bindings;
#[cfg(all(target_os = "linux", target_pointer_width = "64"))]
pub use bindings::*;
