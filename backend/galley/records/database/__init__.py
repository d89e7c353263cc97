"""The database itself: tables, connections, migrations, leases and the thread that writes."""
