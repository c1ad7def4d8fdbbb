/**
	\brief
	@author authorname
*/

#ifndef SPECIFICWORKER_H
#define SPECIFICWORKER_H

#include <genericworker.h>

class SpecificWorker final : public GenericWorker
{
	Q_OBJECT
	public:
		SpecificWorker(const ConfigLoader& configLoader, TuplePrx tprx, bool startup_check);
		~SpecificWorker();

		void Bumper_disable();
		void Bumper_enable();
		RoboCompBumper::SensorStateMap Bumper_getSensorData();
		bool Bumper_isEnabled();
		void Bumper_reset();

	public slots:
		void initialize();
		void compute();
		void emergency();
		void restore();
		int startup_check();

	private:
		bool startup_check_flag;
		float nearest(const RoboCompLaser::TLaserData &scan) const;
		float distance = 0;
		float speed = 0;
		bool enabled = true;
		QMutex mutex;
		RoboCompBumper::SensorStateMap sensors;

	signals:
		//void customSignal();
};

#endif
