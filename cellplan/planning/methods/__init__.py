"""Resolution methods: one file and one signature each."""
