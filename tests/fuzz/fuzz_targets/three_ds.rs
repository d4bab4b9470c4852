#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| input_targets::three_ds(bytes));
