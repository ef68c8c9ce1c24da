"""How fast the ICOtronic driver is beside others: `./dev bench`, see docs/performance.md."""
