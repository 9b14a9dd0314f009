//! The shared library inside FMI units that `@name@ export` writes.

linkwork_fmi::export_unit!(@name@::library);
