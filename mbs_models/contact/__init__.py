"""The tooth contact: two involutes, a force law, and their element in exudyn."""
