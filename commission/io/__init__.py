"""Files and sockets: everything that enters or leaves the program is read, checked and written here."""
