/* The parts of the C library that are built: no security plug-ins, no type library, no TCP. */
#ifndef DDS_FEATURES_H
#define DDS_FEATURES_H

#define DDS_HAS_LIFESPAN 1
#define DDS_HAS_DEADLINE_MISSED 1
#define DDS_HAS_NETWORK_PARTITIONS 1
#define DDS_IS_STATIC_LIBRARY 1

#endif
