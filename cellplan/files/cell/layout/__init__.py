"""The section ``layout`` of a cell file: addresses, ranges and ties."""
