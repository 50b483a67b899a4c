"""The teachers: policies that label training states, each one part of a task."""
