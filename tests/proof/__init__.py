"""The proof of the diagnosis on worlds that it was not made on: protocol, scoring, rivals, and families of cases."""
