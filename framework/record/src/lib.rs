//! Logs: MCAP with protobuf on every channel; summary; comparison of two logs.
